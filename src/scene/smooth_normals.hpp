#pragma once
/// Faces as an OBJ states them, before they become triangles, and the normals that such a file leaves out.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "pathscope/math/vec.hpp"

namespace pathscope {

inline constexpr std::int32_t k_none = -1;

/// Indices from 0 on, or k_none.
struct ObjCorner {
    std::int32_t position = k_none, uv = k_none, normal = k_none;
};

struct ObjFaces {
    std::vector<Vec3> positions, normals;
    std::vector<Vec2> uvs;
    std::vector<ObjCorner> corners;           ///< Of all faces, one after the other.
    std::vector<std::uint32_t> first_corner;  ///< Per face, and one more: the end of the last.
    std::vector<std::uint32_t> material;      ///< Per face.
    std::vector<std::uint32_t> group;         ///< Per face: its smoothing group; 0 = none.

    [[nodiscard]] std::size_t size() const { return material.size(); }
    [[nodiscard]] std::span<ObjCorner> corners_of(std::size_t face) {
        return {corners.data() + first_corner[face], corners.data() + first_corner[face + 1]};
    }
};

/// Gives each corner that has no normal, and whose face is in a smoothing group, the mean of the normals of the
/// faces of that group at its position, weighted by their angles there.
void add_smooth_normals(ObjFaces& faces);

}  // namespace pathscope
