#pragma once
/// Whether two loaders gave the same scene. Include it after testing.hpp, whose CHECK it uses.

#include "pathscope/scene/load.hpp"

namespace pathscope::testing {

inline void check_same(const SceneParts& a, const SceneParts& b) {
    CHECK(a.mesh.positions == b.mesh.positions);
    CHECK(a.mesh.normals == b.mesh.normals);
    CHECK(a.mesh.uvs == b.mesh.uvs);
    CHECK(a.mesh.triangles == b.mesh.triangles);
    CHECK(a.mesh.materials == b.mesh.materials);
    CHECK(a.materials == b.materials);
    CHECK(a.textures == b.textures);
    CHECK(a.envmap.has_value() == b.envmap.has_value());
    if (a.envmap && b.envmap) CHECK(*a.envmap == *b.envmap);
    CHECK(a.degenerate_triangles == b.degenerate_triangles);
}

}  // namespace pathscope::testing
