#include "pathscope/bvh/box_ray.hpp"

#include "geometry/test_meshes.hpp"
#include "pathscope/bvh/bvh.hpp"
#include "pathscope/geometry/triangle.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

BoxInterval test_box(const Ray& ray, const Box& box, const Box& scene) {
    return intersect_box(BoxRay(ray, scene),
                         {box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z}, ray.t_min,
                         ray.t_max);
}

constexpr Box k_unit{{0, 0, 0}, {1, 1, 1}};

bool meets_unit_box(Vec3 origin, Vec3 direction, float t_min = 0, float t_max = k_infinity) {
    return test_box({origin, direction, t_min, t_max}, k_unit, k_unit).met();
}

Ray through(Vec3 origin, Vec3 target) { return {origin, target - origin}; }

}  // namespace

TEST_CASE("a box from outside, from inside, behind, past it, and beyond t_max") {
    CHECK(meets_unit_box({0.5f, 0.5f, -1}, {0, 0, 1}));
    CHECK(meets_unit_box({0.5f, 0.5f, 0.5f}, {1, 2, 3}));
    CHECK_FALSE(meets_unit_box({0.5f, 0.5f, 2}, {0, 0, 1}));
    CHECK_FALSE(meets_unit_box({1.5f, 0.5f, -1}, {0, 0, 1}));
    CHECK_FALSE(meets_unit_box({0.5f, 0.5f, -1}, {0, 0, 1}, 0, 0.99f));
    CHECK(meets_unit_box({0.5f, 0.5f, -1}, {0, 0, 1}, 0, 1));
    CHECK_FALSE(meets_unit_box({0.5f, 0.5f, -1}, {0, 0, 1}, 2.01f));
    CHECK_FALSE(meets_unit_box({0.5f, 0.5f, 0.5f}, {0, 0, 1}, 0, -1));  // the empty interval
}

TEST_CASE("t_near is where the ray enters, or t_min inside") {
    CHECK(test_box({{0.5f, 0.5f, -3}, {0, 0, 1}}, k_unit, k_unit).t_near == doctest::Approx(3));
    CHECK(test_box({{0.5f, 0.5f, 0.5f}, {0, 0, 1}}, k_unit, k_unit).t_near == 0);
}

TEST_CASE("along each axis, either way, with zeros of both signs, on faces, edges and corners: always met") {
    for (int axis = 0; axis < 3; ++axis)
        for (const float zero : {0.0f, -0.0f})
            for (const float sign : {1.0f, -1.0f})
                for (const float p : {0.0f, 0.5f, 1.0f})
                    for (const float q : {0.0f, 0.5f, 1.0f})
                        for (const float start : {-1.0f, 0.0f, 0.5f, 1.0f}) {
                            Vec3 direction{zero, zero, zero}, origin;
                            direction[axis] = sign;
                            origin[axis] = sign > 0 ? start : 1 - start;
                            origin[(axis + 1) % 3] = p;
                            origin[(axis + 2) % 3] = q;
                            CHECK(meets_unit_box(origin, direction));
                        }
}

TEST_CASE("just outside of a face, along it, is a miss: the answer is generous by a hair only") {
    for (const float zero : {0.0f, -0.0f}) {
        CHECK_FALSE(meets_unit_box({1 + 0x1p-18f, 0.5f, -1}, {zero, zero, 1}));
        CHECK_FALSE(meets_unit_box({-0x1p-18f, 0.5f, -1}, {zero, zero, 1}));
    }
}

TEST_CASE("flat boxes are met by rays in their plane and through it") {
    const Box flat{{0, 0, 0.25f}, {1, 1, 0.25f}};
    CHECK(test_box({{-1, 0.5f, 0.25f}, {1, 0, 0}}, flat, k_unit).met());
    CHECK(test_box({{-1, 0.5f, 0.25f}, {1, 0, -0.0f}}, flat, k_unit).met());
    CHECK(test_box({{0.5f, 0.5f, 7}, {0, 0, -1}}, flat, k_unit).met());
    CHECK(test_box({{0.5f, 0.5f, 0.25f}, {0, 0, -1}}, flat, k_unit).met());
    CHECK_FALSE(test_box({{-1, 0.5f, 0.2501f}, {1, 0, 0}}, flat, k_unit).met());
}

TEST_CASE("where the triangle test says hit, the box test says met, and no later") {
    HashRng rng(1);
    for (const Mesh& shape : {random_soup(500, 1), bumpy_sphere(3, 2), box_interior(5)})
        for (const float scale : {1e-3f, 1.0f, 1e5f})
            for (const float distance : {0.0f, 1000.0f}) {
                const Mesh mesh =
                    scaled_and_moved(shape, scale, Vec3{0.7f, -0.4f, 0.59f} * (distance * scale));
                const Box scene = bounds(mesh);
                int hits = 0, missed = 0, late = 0;
                for (int i = 0; i < 8000; ++i) {
                    const TriangleCorners t = corners(mesh, rng.next_u32() % mesh.triangle_count());
                    const Vec3 target =
                        i % 4 == 0 ? t.a : t.at(rng.next_float(), i % 2 == 0 ? 0 : 0.5f * rng.next_float());
                    Ray ray = through(random_point(rng, scene), target);
                    if (i % 5 == 0) ray = {target, {0, 0, -1}};  // starts on the plane, runs along an axis
                    if (i % 5 == 1) ray.direction[i % 3] = 0;
                    const auto hit = intersect_triangle(ray, t);
                    if (!hit) continue;
                    ++hits;
                    ray.t_max = hit->t;
                    const BoxInterval interval = test_box(ray, bounds(t), scene);
                    missed += !interval.met();
                    late += interval.t_near > hit->t;
                }
                CHECK(hits > 1000);
                CHECK(missed == 0);
                CHECK(late == 0);
            }
}
