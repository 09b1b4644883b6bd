#include "pathscope/scene/camera.hpp"

#include <fmt/format.h>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// tan(angle / 2); in double, so that after rounding every libm gives the same float.
float tangent_of_half(double degrees) { return float(std::tan(degrees * (3.14159265358979323846 / 360))); }

/// Sine of the smallest angle between up and the view that still says where up is.
constexpr float k_least_sine = 1e-4f;

}  // namespace

Result<void> check_camera(const Camera& camera) {
    const Vec3 view = camera.look_at - camera.position;
    if (!is_finite(camera.position) || !is_finite(camera.look_at) || !is_finite(camera.up) ||
        !is_finite(view))
        return bad_input("The camera has a coordinate that is not a finite number.");
    if (!(camera.vfov_deg > 0 && camera.vfov_deg < 180))
        return bad_input(fmt::format("The camera's vfov_deg is {}; it must lie between 0 and 180 degrees.",
                                     camera.vfov_deg));
    if (!(length_squared(view) > 0))
        return bad_input("The camera's position and look_at are the same point; move one of them.");
    if (!(length(cross(normalize(view), camera.up)) > k_least_sine * length(camera.up)))
        return bad_input("The camera's up is zero or points along its view; choose another up.");
    return {};
}

CameraFrame make_camera(const Camera& view, int width, int height) {
    CHECK(width > 0 && height > 0, width, height);
    CHECK(check_camera(view), view.vfov_deg);
    const Vec3 forward = normalize(view.look_at - view.position);
    const Vec3 right = normalize(cross(forward, view.up));
    const Vec3 down = cross(forward, right);

    const float pixel = 2 * tangent_of_half(view.vfov_deg) / float(height);
    CameraFrame camera;
    camera.position = view.position;
    camera.forward = forward;
    camera.step_x = right * pixel;
    camera.step_y = down * pixel;
    camera.corner = forward - camera.step_x * (0.5f * float(width)) - camera.step_y * (0.5f * float(height));
    camera.width = width;
    camera.height = height;
    return camera;
}

std::optional<Vec2> project_point(const CameraFrame& camera, Vec3 point) {
    const Vec3 to_point = point - camera.position;
    const float depth = dot(to_point, camera.forward);
    if (!(depth > 0)) return std::nullopt;
    const Vec3 on_plane = to_point / depth - camera.corner;
    return Vec2{dot(on_plane, camera.step_x) / length_squared(camera.step_x),
                dot(on_plane, camera.step_y) / length_squared(camera.step_y)};
}

Camera camera_that_sees(const Box& bounds, Vec3 up, float aspect) {
    CHECK(aspect > 0, aspect);
    Camera camera;
    if (bounds.empty()) return camera;
    camera.up = up;
    const float extent = length(bounds.extent());
    const float radius = extent > 0 ? extent / 2 : 1;

    // The narrower of the two opening angles decides how far away the sphere fits.
    const float half_height = tangent_of_half(camera.vfov_deg);
    const float half_angle = std::atan(half_height * std::min(1.0f, aspect));
    const Vec3 right{1, 0, 0}, front = cross(right, up);
    const Vec3 from_centre = normalize(0.1f * right + 0.15f * up + front);
    camera.look_at = bounds.centre();
    camera.position = camera.look_at + from_centre * (radius / std::sin(half_angle));
    return camera;
}

}  // namespace pathscope
