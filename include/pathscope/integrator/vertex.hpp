#pragma once
/// A path vertex, the random numbers it takes its decisions by, and the step to the next one.
///
///   T' = T · f(wo,wi) · |cos wi| / pdf(wi)
///
/// Convention: outgoing points back along the ray that arrived, incoming along the ray that goes on; both away from the
/// surface. The vertex keeps outgoing in its local frame (z = shading normal on the viewer's side).
/// Thread safety: values, pure functions.   Test: tests/integrator/test_path_estimator.cpp

#include <cstdint>
#include <optional>

#include "pathscope/geometry/spawn.hpp"
#include "pathscope/integrator/settings.hpp"
#include "pathscope/sampling/sampler.hpp"
#include "pathscope/sampling/sampler_batch.hpp"
#include "pathscope/scene/light_sampling.hpp"
#include "pathscope/scene/scene.hpp"
#include "pathscope/scene/surface.hpp"
#include "pathscope/shading/seen_bsdf.hpp"

namespace pathscope {

/// Dimension of the sampler that places a sample within its pixel.
inline constexpr std::uint32_t k_pixel_dimension = 0;

/// The random numbers of one bounce, each decision with a dimension of its own: whoever skips a decision (the direct
/// pass plays no roulette) leaves the others as they are. The four that nearly every vertex needs are made together.
class BounceSample {
  public:
    static constexpr std::uint32_t k_decisions = 5;
    [[nodiscard]] static std::uint32_t first_dimension(int bounce) {
        return 1 + k_decisions * std::uint32_t(bounce);
    }

    BounceSample(const PixelSampler& sampler, int bounce)
        : sampler_(&sampler),
          roulette_dimension_(first_dimension(bounce) + 4),
          pairs_(sampler.get_four_2d(first_dimension(bounce))) {}

    /// Of numbers that were made for many samples, from first_dimension() on.
    BounceSample(const PairRows<k_decisions>& rows, std::size_t sample) : roulette_(rows.x[4][sample]) {
        for (std::size_t i = 0; i < 4; ++i) {
            pairs_.x[i] = rows.x[i][sample];
            pairs_.y[i] = rows.y[i][sample];
        }
    }

    [[nodiscard]] float light_pick() const { return pairs_.x[0]; }
    [[nodiscard]] Vec2 light_point() const { return pairs_[1]; }
    [[nodiscard]] float lobe() const { return pairs_.x[2]; }
    [[nodiscard]] Vec2 direction() const { return pairs_[3]; }
    [[nodiscard]] float roulette() const {
        return sampler_ != nullptr ? sampler_->get_1d(roulette_dimension_) : roulette_;
    }

  private:
    const PixelSampler* sampler_ = nullptr;  // Asked for the number that few vertices need.
    std::uint32_t roulette_dimension_ = 0;
    float roulette_ = 0;
    FourPairs pairs_;
};

struct Vertex {
    const SurfacePoint& point;  ///< Of the hit, which must outlive the vertex.
    SurfaceSide side;
    SeenBsdf seen;  ///< Along `outgoing`, local: shared by all samples taken here.
    bool specular;  ///< Only delta lobes: no light sample can be connected to it.

    /// Everything is made in its place. Requires: outgoing of length one, in world space.
    Vertex(const Scene& scene, const SceneHit& hit, Vec3 outgoing)
        : point(hit.point),
          side(see_side(scene, hit, outgoing)),
          seen{make_bsdf(scene, hit), side.frame.to_local(outgoing), {}},
          specular(is_specular(seen.bsdf)) {
        look(seen);
    }

    [[nodiscard]] LightReference light_reference() const { return {point.position, side.frame.normal}; }
};

/// What a ray leaves, as far as the light that it runs into must know: by which density its direction was drawn.
struct PathOrigin {
    LightReference reference;
    float pdf_solid_angle = 0;
    bool delta = true;     ///< From the camera, or by a delta lobe: no light sample competes with this ray.
    bool diffuse = false;  ///< The vertex is not specular.
};

struct NextDirection {
    Vec3 direction;  ///< World space, length one.
    Rgb weight;      ///< f |cos| / pdf
    float pdf_solid_angle = 0;
    bool delta = false;  ///< By a delta lobe, without density.
};

/// The vertex, as the ray in this direction leaves it.
[[nodiscard]] inline PathOrigin make_origin(const Vertex& vertex, const NextDirection& next) {
    return {vertex.light_reference(), next.pdf_solid_angle, next.delta, !vertex.specular};
}

/// Nothing if the path ends here: absorbed, or against one of the two normals.
[[nodiscard]] inline std::optional<NextDirection> sample_next_direction(const TransportSettings& settings,
                                                                        const Vertex& vertex,
                                                                        const BounceSample& random) {
    std::optional<NextDirection> next;
    const std::optional<BsdfSample> sample =
        sample_direction(settings.hemisphere, vertex.seen, random.lobe(), random.direction());
    if (!sample) return next;
    const Vec3 direction = vertex.side.frame.to_world(sample->incoming);
    if (!is_consistent(vertex.side, direction)) return next;
    next.emplace();
    next->direction = direction;
    next->weight = sample->weight;
    next->pdf_solid_angle = sample->pdf_solid_angle;
    next->delta = sample->specular;
    return next;
}

}  // namespace pathscope
