#pragma once
/// Many samples at once: their paths go side by side, bounce by bounce. What a renderer runs.
///
///     radiance of a sample  =  { estimate_radiance<direct>(...), estimate_radiance<indirect>(...) },   bit by bit
///
/// (Of a sample that is no radiance, neither of the two is one.)
///
/// Why: what paths have to do at the same time can be done together. Camera rays are traced in packets, random numbers are made
/// for a register full of paths, and shadow rays of neighbouring points are asked one after the other, so that they are stopped by
/// what stopped the last one. And where both parts are asked for, a client without servers, the walk that they share is walked
/// once: it saves a fifth of the rays of a Cornell box.
/// The text to read is path_estimator.hpp; here the same steps keep two accounts. They part at the first roulette, which
/// the direct part does not play: then a ray that the indirect part would not have traced may still be traced for the
/// direct one.
///
/// Units, Requires: as estimate_radiance(). Thread safety: none; each thread has a batch of its own.
/// Test: tests/integrator/test_path_batch.cpp

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "pathscope/integrator/path_estimator.hpp"
#include "pathscope/scene/camera.hpp"

namespace pathscope {

struct PartsRadiance {
    Rgb direct, indirect;
};

/// Which parts are asked for; the other stays black.
struct LightParts {
    bool direct = true, indirect = true;
};

class PathBatch {
  public:
    /// Most paths in a batch. Of 32 too few are left after some bounces to fill registers; more than these gain nothing.
    static constexpr std::size_t k_capacity = k_sampler_batch;

    /// scene, camera, settings: must outlive the batch, unchanged.
    PathBatch(const Scene& scene, const CameraFrame& camera, const TransportSettings& settings,
              LightParts parts);

    /// Of the samples that were added since the last trace().
    [[nodiscard]] std::size_t size() const { return traced_ ? 0 : paths_.size(); }
    [[nodiscard]] bool full() const { return size() == k_capacity; }

    /// A sample of pixel (x, y), somewhere in it. Neighbouring pixels, one after the other, are traced faster. Requires: !full().
    void add(int x, int y, const PixelSampler& sampler);

    /// Follows all paths to their ends. The radiances, in the order of add(), are there until the next add(), which begins a
    /// new batch. rays: counts all that are traced. Requires: something was added.
    [[nodiscard]] std::span<const PartsRadiance> trace(std::uint64_t& rays);

  private:
    struct Path {
        Path(int its_x, int its_y, const PixelSampler& its_sampler)
            : x(its_x), y(its_y), sampler(its_sampler) {}

        int x, y;  // The pixel.
        PixelSampler sampler;
        Rgb throughput{1, 1, 1};         // Of the indirect part, roulette included.
        Rgb direct_throughput{1, 1, 1};  // Until the direct part ends.
        PathStrength strength;
        PathOrigin origin;
        int diffuse_vertices = 0;
        bool goes_on = true;  // Beyond what the next ray meets.
    };
    /// The light samples at a vertex of a path.
    struct LightRequest {
        std::uint32_t path;
        bool direct;
        Rgb throughput;
        std::size_t end;  // Of its rays.
    };

    template <class Step>
    void keep_alive(Step step);
    [[nodiscard]] bool arrive(std::uint32_t path, int bounce);
    template <std::size_t dimensions>
    void draw_numbers(std::uint32_t first_dimension, PairRows<dimensions>& numbers);
    void trace_camera_rays();
    [[nodiscard]] bool leave(std::uint32_t path, int bounce, const BounceSample& random);
    void ask_lights(std::uint32_t path, bool direct, const Vertex& vertex, const BounceSample& random);
    void collect_light(int bounce);

    const Scene& scene_;
    const CameraFrame& camera_;
    const TransportSettings& settings_;
    const LightParts parts_;
    const int light_count_;

    // Of each path, by its number.
    std::vector<Path> paths_;
    std::vector<Ray> rays_;
    std::vector<std::optional<SceneHit>> hits_;
    std::vector<PartsRadiance> radiance_;

    std::vector<std::uint32_t> alive_;  // Numbers of paths that go on, in order.

    // Of a bounce.
    SamplerBatch samplers_;  // In the order of alive_, as the next.
    PairRows<1> places_;     // Within the pixel.
    PairRows<BounceSample::k_decisions> numbers_;
    std::vector<LightRequest> requests_;
    std::vector<UnshadowedLight> lights_;

    OccluderCache occluders_;

    bool traced_ = false;
};

}  // namespace pathscope
