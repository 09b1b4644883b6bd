#pragma once
/// An ObjModel as one run of bytes, for the mesh cache, in the byte order of this machine.
///
///     model = degenerate-triangles names names array array array array array
///     names = count *( length *OCTET )    ; of materials; of MTL files
///     array = count *element              ; positions, normals, uvs, triangles, material ids
///     degenerate-triangles, count and length are u64
///
/// Thread safety: yes.   Test: tests/scene/test_mesh_cache.cpp

#include <optional>
#include <string>
#include <string_view>

#include "pathscope/scene/obj.hpp"

namespace pathscope {

[[nodiscard]] std::string model_bytes(const ObjModel& model);

/// Nothing unless the bytes are a model, all of them, whose mesh is valid and whose triangles have a material.
[[nodiscard]] std::optional<ObjModel> model_from_bytes(std::string_view bytes);

}  // namespace pathscope
