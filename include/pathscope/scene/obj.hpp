#pragma once
/// Wavefront OBJ: one text file to one indexed mesh and the names of its materials.
///
/// tinyobjloader reads the numbers; around it stands what it leaves out. It takes a malformed number for zero
/// and an index out of range for a warning without a line, so check_obj() (src/scene/obj_check.cpp) reads the
/// text first and answers with file and line. Faces of more than three corners are cut by ear clipping
/// (triangulate.hpp), whose triangles add up to the polygon. Corners that share position, normal and uv share
/// a vertex.
///
/// Normals. Given ones are used as they stand; zero ones, and such that are not finite, mean "flat" (the
/// triangle's own normal). Where a face gives none and smoothing is on, its corners get the mean of the normals
/// of all faces of its smoothing group g > 0 at that position, each weighted by its angle there; that does not
/// depend on how faces were cut into triangles. Group 0 or off, where every file starts, is flat.
///
/// Reference: Thürmer & Wüthrich 1998, "Computing Vertex Normals from Polygonal Facets".
///
/// Thread safety: yes.   Test: tests/scene/test_obj.cpp, test_obj_check.cpp

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/geometry/mesh.hpp"

namespace pathscope {

struct ObjModel {
    Mesh mesh;                                ///< Material ids are indices into material_names.
    std::vector<std::string> material_names;  ///< In order of first use; "" = faces before any usemtl.
    std::vector<std::string> material_files;  ///< Of the mtllib lines, in order, as written.
    std::size_t degenerate_triangles = 0;     ///< Left out, because they have no area.
};

/// `shown_path` is how errors name the file.
[[nodiscard]] Result<ObjModel> parse_obj(std::string text, const std::string& shown_path, bool smoothing);

}  // namespace pathscope
