#include "../../src/bvh/spatial_split.hpp"

#include <array>
#include <cmath>

#include "bvh/oracle.hpp"
#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("the two parts of a reference that is cut hold all of the triangle in its box") {
    HashRng rng(11);
    const Mesh soup = random_soup(2000, 12);
    for (const float scale : {1e-3f, 1.0f, 1e5f})
        for (const float distance : {0.0f, 1000.0f}) {
            const Mesh mesh = scaled_and_moved(soup, scale, Vec3{0.7f, -0.4f, 0.59f} * (distance * scale));
            int crossings = 0, lost = 0;
            for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
                const TriangleCorners t = corners(mesh, i);
                const Box box = bounds(t);
                const int axis = static_cast<int>(rng.next_u32() % 3);
                const float plane = lerp(box.low[axis], box.high[axis], rng.next_float());
                if (!(box.low[axis] < plane && plane < box.high[axis])) continue;
                const CutReference parts = cut(mesh, {box.low, i, box.high, 0}, axis, plane);
                CHECK(parts.left.high[axis] <= plane);
                CHECK(parts.right.low[axis] >= plane);

                // The parts are the hulls of corners and crossings: these are all that must be held.
                const auto holds = [](const Reference& part, DoubleVec p) {
                    const auto within = [](double x, float low, float high) {
                        const double e = 1e-14 * std::abs(x);  // The test's own rounding.
                        return x >= double(low) - e && x <= double(high) + e;
                    };
                    return within(p.x, part.low.x, part.high.x) && within(p.y, part.low.y, part.high.y) &&
                           within(p.z, part.low.z, part.high.z);
                };
                const std::array<Vec3, 3> corner{t.a, t.b, t.c};
                for (std::size_t k = 0; k < 3; ++k) {
                    const Vec3 from = corner[k], to = corner[(k + 1) % 3];
                    if (from[axis] <= plane) lost += !holds(parts.left, to_double(from));
                    if (from[axis] >= plane) lost += !holds(parts.right, to_double(from));
                    if ((from[axis] < plane) == (to[axis] < plane)) continue;
                    const double share =
                        (double(plane) - double(from[axis])) / (double(to[axis]) - double(from[axis]));
                    const DoubleVec p = to_double(from) + share * (to_double(to) - to_double(from));
                    ++crossings;
                    lost += !holds(parts.left, p);
                    lost += !holds(parts.right, p);
                }
            }
            CHECK(crossings > 2000);
            CHECK(lost == 0);
        }
}
