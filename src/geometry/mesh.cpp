#include "pathscope/geometry/mesh.hpp"

#include <string>

namespace pathscope {
namespace {

Error wrong_length(const char* what, std::size_t found, std::size_t expected) {
    return bad_input("the mesh has " + std::to_string(found) + " " + what + ", it needs none or " +
                     std::to_string(expected));
}

Result<void> check_lengths(const Mesh& mesh) {
    const std::size_t vertices = mesh.positions.size();
    if (!mesh.normals.empty() && mesh.normals.size() != vertices)
        return wrong_length("normals", mesh.normals.size(), vertices);
    if (!mesh.uvs.empty() && mesh.uvs.size() != vertices)
        return wrong_length("texture coordinates", mesh.uvs.size(), vertices);
    if (!mesh.materials.empty() && mesh.materials.size() != mesh.triangles.size())
        return wrong_length("material numbers", mesh.materials.size(), mesh.triangles.size());
    if (mesh.triangles.size() > k_max_triangles)
        return bad_input("the mesh has " + std::to_string(mesh.triangles.size()) + " triangles, more than " +
                         std::to_string(k_max_triangles) + "; split the scene");
    return {};
}

Result<void> check_vertices(const Mesh& mesh) {
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        const bool uv_finite =
            mesh.uvs.empty() || (std::isfinite(mesh.uvs[i].x) && std::isfinite(mesh.uvs[i].y));
        if (is_finite(mesh.positions[i]) && (mesh.normals.empty() || is_finite(mesh.normals[i])) && uv_finite)
            continue;
        return bad_input(
            "vertex " + std::to_string(i) +
            " of the mesh has a position, normal or texture coordinate that is not a finite number");
    }
    return {};
}

Result<void> check_indices(const Mesh& mesh) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const TriangleIndices& t = mesh.triangles[i];
        const std::uint32_t largest = std::max(t.a, std::max(t.b, t.c));
        if (largest >= mesh.positions.size())
            return bad_input("triangle " + std::to_string(i) + " of the mesh uses vertex " +
                             std::to_string(largest) + ", but there are only " +
                             std::to_string(mesh.positions.size()));
    }
    return {};
}

}  // namespace

Box bounds(const Mesh& mesh) {
    Box box;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) box.add(bounds(corners(mesh, i)));
    return box;
}

float longest_side(const Mesh& mesh) {
    float longest = 0;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i)
        longest = std::max(longest, longest_side(corners(mesh, i)));
    return longest;
}

Result<void> validate(const Mesh& mesh) {
    if (Result<void> lengths = check_lengths(mesh); !lengths) return lengths;
    if (Result<void> vertices = check_vertices(mesh); !vertices) return vertices;
    return check_indices(mesh);
}

}  // namespace pathscope
