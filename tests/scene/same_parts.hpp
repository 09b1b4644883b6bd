#pragma once
/// Whether two loaders gave the same scene. Include it after testing.hpp, whose CHECK it uses.

#include "pathscope/scene/load.hpp"

namespace pathscope::testing {

inline void check_same(const Mesh& a, const Mesh& b) {
    CHECK(a.positions == b.positions);
    CHECK(a.normals == b.normals);
    CHECK(a.uvs == b.uvs);
    CHECK(a.triangles == b.triangles);
    CHECK(a.materials == b.materials);
}

inline void check_same(const SceneParts& a, const SceneParts& b) {
    check_same(a.mesh, b.mesh);
    CHECK(a.materials == b.materials);
    CHECK(a.textures == b.textures);
    CHECK(a.envmap.has_value() == b.envmap.has_value());
    if (a.envmap && b.envmap) CHECK(*a.envmap == *b.envmap);
    CHECK(a.degenerate_triangles == b.degenerate_triangles);
}

}  // namespace pathscope::testing
