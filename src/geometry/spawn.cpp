#include "pathscope/geometry/spawn.hpp"

namespace pathscope {

Ray spawn_ray_to(const SurfacePoint& point, const RayTarget& target) {
    const Vec3 between = target.position - point.position;
    const Vec3 origin = offset_origin(point.position, point.position_error, point.geometric_normal, between);

    // At the far end the ray has drifted by the rounding of its direction and length, a share of the distance.
    const Vec3 target_error = target.position_error + abs(between) * 0x1p-22f;
    const Vec3 end = offset_origin(target.position, target_error, target.normal, -between);

    const Vec3 segment = end - origin;
    const float distance = length(segment);
    if (!(dot(segment, between) > 0)) return {origin, point.geometric_normal, 0, -1};
    return {origin, segment / distance, 0, distance};
}

}  // namespace pathscope
