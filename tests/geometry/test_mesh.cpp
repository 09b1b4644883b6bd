#include "pathscope/geometry/mesh.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {
Mesh one_triangle() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}
}  // namespace

TEST_CASE("normal, area and bounds of a triangle that one can do on paper") {
    const TriangleCorners t = corners(one_triangle(), 0);
    CHECK(geometric_normal(t) == Vec3{0, 0, 1});
    CHECK(geometric_normal({t.a, t.c, t.b}) == Vec3{0, 0, -1});
    CHECK(area(t) == 6);
    CHECK(bounds(t).low == Vec3{0, 0, 0});
    CHECK(bounds(t).high == Vec3{3, 4, 0});
    CHECK(t.at(0, 0) == t.a);
    CHECK(t.at(1, 0) == t.b);
    CHECK(t.at(0, 1) == t.c);
}

TEST_CASE("the bounds of a mesh are those of its triangles, not of unused positions") {
    Mesh mesh = one_triangle();
    mesh.positions.push_back({100, 100, 100});
    CHECK(bounds(mesh).high == Vec3{3, 4, 0});
    CHECK(bounds(Mesh{}).empty());
}

TEST_CASE("normals and areas keep their digits at any size") {
    for (const float scale : {1e-12f, 1e-3f, 1.0f, 1e5f, 1e15f}) {
        const TriangleCorners t{{0, 0, 0}, {scale, 0, 0}, {0, scale, 0}};
        CHECK(geometric_normal(t) == Vec3{0, 0, 1});
        CHECK(area(t) == doctest::Approx(0.5 * scale * scale).epsilon(1e-6));
    }
    // A sliver whose area, squared, is below the smallest float.
    const Vec3 n = geometric_normal({{0, 0, 0}, {1e-3f, 0, 0}, {0, 1e-20f, 0}});
    CHECK(n == Vec3{0, 0, 1});
}

TEST_CASE("a triangle is degenerate if its corners lie on a line, and only then") {
    const Vec3 a{1, 2, 3}, d{0.25f, -0.5f, 1};
    CHECK(is_degenerate({a, a, a}));
    CHECK(is_degenerate({a, a + d, a + d}));
    CHECK(is_degenerate({a, a + d, a + d * 3}));
    CHECK(geometric_normal({a, a + d, a + d * 3}) == Vec3{});
    CHECK(area({a, a + d, a + d * 3}) == 0);
    const Vec3 next_to_line{a.x + 3 * d.x, a.y + 3 * d.y, std::nextafter(a.z + 3 * d.z, 100.0f)};
    CHECK_FALSE(is_degenerate({a, a + d, next_to_line}));
}

TEST_CASE("validate names what is wrong and where") {
    CHECK(validate(one_triangle()));
    CHECK(validate(Mesh{}));

    Mesh mesh = one_triangle();
    mesh.triangles.push_back({0, 1, 3});
    CHECK(validate(mesh).error().message == "triangle 1 of the mesh uses vertex 3, but there are only 3");

    mesh = one_triangle();
    mesh.positions[1].y = std::nanf("");
    CHECK(validate(mesh).error().message.starts_with("vertex 1 of the mesh"));
    mesh = one_triangle();
    mesh.uvs = {{0, 0}, {0, 0}, {0, k_infinity}};
    CHECK(validate(mesh).error().message.starts_with("vertex 2 of the mesh"));

    mesh = one_triangle();
    mesh.normals = {{0, 0, 1}};
    CHECK(validate(mesh).error().message == "the mesh has 1 normals, it needs none or 3");
    mesh = one_triangle();
    mesh.uvs.resize(4);
    CHECK(validate(mesh).error().message.starts_with("the mesh has 4 texture coordinates"));
    mesh = one_triangle();
    mesh.materials = {1, 2};
    CHECK(validate(mesh).error().message == "the mesh has 2 material numbers, it needs none or 1");
    CHECK(validate(mesh).error().kind == ErrorKind::bad_input);
}

TEST_CASE("without material numbers all triangles have number 0") {
    Mesh mesh = one_triangle();
    CHECK(mesh.material_of(0) == 0);
    mesh.materials = {7};
    CHECK(mesh.material_of(0) == 7);
}
