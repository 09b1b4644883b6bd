#pragma once
/// A pinhole camera: pixel (x, y) and a point in it to a ray.
///
///   direction = normalize(corner + (x + u.x) step_x + (y + u.y) step_y)
///
/// corner points at the upper left corner of the image, so row 0 is the top row. Coordinates are
/// right-handed: with the default view (along -z, y up) the right edge of the image lies towards +x. A sample
/// point is uniform in its pixel (a box filter of one pixel), so pixels of different blocks share no samples.
/// Units: positions in scene units, vfov_deg is the vertical opening angle in degrees; pixels are square.
/// Thread safety: values.   Test: tests/scene/test_camera.cpp

#include <optional>

#include "pathscope/core/result.hpp"
#include "pathscope/math/box.hpp"
#include "pathscope/math/ray.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

/// What a person says about a camera; part of the render state.
struct Camera {
    Vec3 position{0, 0, 0};
    Vec3 look_at{0, 0, -1};
    Vec3 up{0, 1, 0};
    float vfov_deg = 45;

    friend constexpr bool operator==(const Camera&, const Camera&) = default;
};

/// Says what is wrong with a camera that has no image: equal position and target, an up that points along the
/// view, an angle outside (0, 180), a number that is not finite.
[[nodiscard]] Result<void> check_camera(const Camera& camera);

/// A camera made ready for an image of width x height pixels.
struct CameraFrame {
    Vec3 position;
    Vec3 corner;          ///< From the pinhole to the upper left corner of the image plane at distance one.
    Vec3 step_x, step_y;  ///< From one pixel to the next, to the right and down.
    Vec3 forward;         ///< Length one.
    int width = 0, height = 0;
};

/// Requires: check_camera accepts it; width, height > 0.
[[nodiscard]] CameraFrame make_camera(const Camera& view, int width, int height);

/// The ray through the point u of pixel (x, y); its direction has length one.
/// Requires: u in [0, 1)^2. Pixels outside the image are allowed (guides look beyond the border).
[[nodiscard]] inline Ray camera_ray(const CameraFrame& camera, int x, int y, Vec2 u) {
    const Vec3 direction =
        camera.corner + (float(x) + u.x) * camera.step_x + (float(y) + u.y) * camera.step_y;
    return {camera.position, normalize(direction)};
}

/// Where a point of the scene appears, in pixels from the upper left corner; the inverse of camera_ray. May
/// lie outside the image. Nothing if the point is not in front of the camera.
[[nodiscard]] std::optional<Vec2> project_point(const CameraFrame& camera, Vec3 point);

/// A view from the front (+z; -y where z is up), slightly above and beside the axis so that no axis-aligned
/// plane is seen edge-on, in which the bounding sphere of the box just fits into an image of this aspect
/// (width / height). For a bare .obj, which names no camera. An empty box gives the default camera.
/// Requires: up is +y or +z; aspect > 0.
[[nodiscard]] Camera camera_that_sees(const Box& bounds, Vec3 up = {0, 1, 0}, float aspect = 1);

}  // namespace pathscope
