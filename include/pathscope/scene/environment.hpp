#pragma once
/// An environment map: light from infinity, given by a latitude-longitude picture of all directions.
///
///   u = 1/2 + atan2(x, -z) / 2π,   v = acos(y) / π,   dω = 2π² sin(πv) du dv
///
/// so the centre of the picture lies towards -z, where the default camera looks, its right towards +x, its
/// top row at +y: from inside, the picture is seen as it lies in the file. Where z is up, (x, z, -y) take the
/// place of (x, y, z), and the centre lies towards +y. It can be turned about the up axis.
/// Radiance is bilinear between the centres of texels (around the seam in u, held at the poles in v).
/// Directions are drawn in proportion to the luminance of that bilinear picture, averaged over each texel,
/// times sin θ.
/// Trap: an average of the texels as they are would leave a black texel beside a bright one without samples,
/// although interpolation makes it glow, and the image would lose that light.
/// Angles come from arithmetic alone, not libm, so that all machines see the same bits (unit_circle.hpp).
/// Thread safety: values, read only.   Test: tests/scene/test_environment.cpp

#include <string>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/image/image.hpp"
#include "pathscope/math/frame.hpp"
#include "pathscope/math/vec.hpp"
#include "pathscope/sampling/distribution.hpp"
#include "pathscope/scene/scene_file.hpp"

namespace pathscope {

struct EnvironmentMap {
    Image radiance;               ///< Scale included.
    Frame axes;                   ///< The picture's x, y (tangent, bitangent) and z (normal) in the world.
    Distribution2d distribution;  ///< Over (u, v).
    Rgb mean_radiance;            ///< Over all directions.
};

/// Refuses a picture that is empty, all black, or holds a negative or infinite radiance, and a scale that is
/// not positive; the sentence begins with `name`. rotate_deg turns it counter-clockwise as seen from above.
[[nodiscard]] Result<EnvironmentMap> make_environment_map(const std::string& name, Image picture,
                                                          float scale = 1, float rotate_deg = 0,
                                                          UpAxis up = UpAxis::y);

/// Requires, here and below: direction of length one.
[[nodiscard]] Rgb environment_map_radiance(const EnvironmentMap& map, Vec3 direction);

/// A direction with density sample_environment_map_pdf. Requires: u in [0, 1)^2.
[[nodiscard]] Vec3 sample_environment_map(const EnvironmentMap& map, Vec2 u);
[[nodiscard]] float sample_environment_map_pdf(const EnvironmentMap& map, Vec3 direction);

/// Where in the picture a direction lies, u and v in [0, 1), and back.
[[nodiscard]] Vec2 lat_long_of(Vec3 picture_direction);
[[nodiscard]] Vec3 direction_of_lat_long(Vec2 uv);

}  // namespace pathscope
