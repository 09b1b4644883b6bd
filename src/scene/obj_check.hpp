#pragma once
/// Reads through an OBJ text before tinyobjloader does, and answers what is wrong with file and line.
///
/// tinyobjloader takes a number that it cannot read for zero, and an index out of range for a matter of whoever
/// uses it. It also passes over smoothing groups and splits names at blanks when it hands out faces one by one.
/// After this check every v, vn and vt has its numbers, and every face three corners or more that exist.
/// Thread safety: yes.   Test: tests/scene/test_obj_check.cpp

#include <cstdint>
#include <string>
#include <vector>

#include "pathscope/core/result.hpp"

namespace pathscope {

/// The faces from `first_face` on, up to the next entry, belong to smoothing group `group`; 0 = none.
struct SmoothingRun {
    std::uint32_t first_face = 0;
    std::uint32_t group = 0;
};

struct ObjOutline {
    std::vector<std::string> material_files;        ///< Each mtllib line, as written.
    std::vector<SmoothingRun> smoothing;            ///< Starts with {0, 0}.
    std::vector<std::uint32_t> not_finite_normals;  ///< Numbers of vn lines with NaN or infinity.
    std::uint32_t positions = 0, normals = 0, uvs = 0, faces = 0;
    std::size_t corners = 0;  ///< Of all faces together.
};

/// A '\' at the end of a line goes on in the next: puts blanks in place of both, so that offsets stay.
/// Returns the offsets of the line ends that went, which check_obj needs to count lines.
[[nodiscard]] std::vector<std::size_t> join_continued_lines(std::string& text);

/// Puts blanks in place of slashes that nothing follows (f 1// 2// 3//), which tinyobjloader misreads.
[[nodiscard]] Result<ObjOutline> check_obj(std::string& text, const std::vector<std::size_t>& joined,
                                           const std::string& shown_path);

}  // namespace pathscope
