#include <algorithm>
#include <array>
#include <type_traits>

#include "pathscope/bvh/tree.hpp"
#include "tracer.hpp"

namespace pathscope::bench {
namespace {

/// The wide tree that renders.
struct Wide {
    using Tree = WideBvh;
    static constexpr const char* k_name = "wide";
    static Tree build(const Mesh& mesh, int threads) { return build_wide_bvh(mesh, {}, threads); }
    static std::size_t bytes(const Tree& tree) { return wide_bvh_stats(tree).bytes; }
};

/// The two-wide tree that lessons show.
struct TwoWide {
    using Tree = Bvh;
    static constexpr const char* k_name = "two-wide";
    static Tree build(const Mesh& mesh, int threads) { return build_bvh(mesh, {}, threads); }
    static std::size_t bytes(const Tree& tree) { return bvh_stats(tree).bytes; }
};

template <class Tree>
void trace_closest(const Tree& tree, std::span<const Ray> rays, std::span<Answer> answers) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const auto hit = closest_hit(tree, rays[i]);
        answers[i] = hit ? Answer{hit->t, hit->triangle} : Answer{};
    }
}

template <class Tree>
void trace_any(const Tree& tree, std::span<const Ray> rays, std::span<Answer> answers) {
    for (std::size_t i = 0; i < rays.size(); ++i)
        answers[i].triangle = any_hit(tree, rays[i]) ? 0 : k_no_answer;
}

void trace_closest_packets(const WideBvh& tree, std::span<const Ray> rays, std::span<Answer> answers) {
    std::array<std::optional<Hit>, k_packet_rays> hits;
    for (std::size_t first = 0; first < rays.size(); first += k_packet_rays) {
        const std::size_t count = std::min(k_packet_rays, rays.size() - first);
        closest_hits(tree, rays.subspan(first, count), std::span(hits).first(count));
        for (std::size_t i = 0; i < count; ++i)
            answers[first + i] = hits[i] ? Answer{hits[i]->t, hits[i]->triangle} : Answer{};
    }
}

void trace_any_packets(const WideBvh& tree, std::span<const Ray> rays, std::span<Answer> answers) {
    for (std::size_t first = 0; first < rays.size(); first += k_packet_rays) {
        const std::size_t count = std::min(k_packet_rays, rays.size() - first);
        const std::uint32_t met = any_hits(tree, rays.subspan(first, count));
        for (std::size_t i = 0; i < count; ++i)
            answers[first + i].triangle = (met >> i & 1) != 0 ? 0 : k_no_answer;
    }
}

/// The cache is empty at the beginning of each batch.
void trace_any_cached(const WideBvh& tree, std::span<const Ray> rays, std::span<Answer> answers) {
    OccluderCache occluders;
    for (std::size_t i = 0; i < rays.size(); ++i)
        answers[i].triangle = any_hit(tree, rays[i], AcceptAll{}, occluders) ? 0 : k_no_answer;
}

/// A tree that closest_hit() and any_hit() know. Policy: its type, its name, how to build it, its size.
template <class Policy>
class TreeTracer final : public Tracer {
  public:
    std::string name() const override { return Policy::k_name; }

    Cost build(const Mesh& mesh, int threads) override {
        tree_ = {};
        return cost_of([&] { tree_ = Policy::build(mesh, threads); });
    }

    std::size_t bytes() const override { return Policy::bytes(tree_); }

    std::vector<TraceCall> calls(RayQuery query, bool coherent) const override {
        const bool any = query == RayQuery::any;
        std::vector<TraceCall> calls;
        if (any)
            calls.push_back(
                {"any_hit", [this](auto rays, auto answers) { trace_any(tree_, rays, answers); }});
        else
            calls.push_back(
                {"closest_hit", [this](auto rays, auto answers) { trace_closest(tree_, rays, answers); }});
        if constexpr (std::is_same_v<typename Policy::Tree, WideBvh>) {
            if (any)
                calls.push_back({"any_hit, occluders kept", [this](auto rays, auto answers) {
                                     trace_any_cached(tree_, rays, answers);
                                 }});
            if (coherent && any)
                calls.push_back({"any_hits", [this](auto rays, auto answers) {
                                     trace_any_packets(tree_, rays, answers);
                                 }});
            if (coherent && !any)
                calls.push_back({"closest_hits", [this](auto rays, auto answers) {
                                     trace_closest_packets(tree_, rays, answers);
                                 }});
        }
        return calls;
    }

    std::optional<TraversalCounts> count(RayQuery query, std::span<const Ray> rays) const override {
        TraversalCounts counts;
        if constexpr (requires(const typename Policy::Tree& tree, const Ray& ray, AcceptAll accept) {
                          closest_hit(tree, ray, accept, counts);
                          any_hit(tree, ray, accept, counts);
                      }) {
            for (const Ray& ray : rays)
                if (query == RayQuery::any)
                    (void)any_hit(tree_, ray, AcceptAll{}, counts);
                else
                    (void)closest_hit(tree_, ray, AcceptAll{}, counts);
            return counts;
        }
        return std::nullopt;
    }

  private:
    typename Policy::Tree tree_;
};

}  // namespace

std::vector<std::unique_ptr<Tracer>> make_our_tracers() {
    std::vector<std::unique_ptr<Tracer>> tracers;
    tracers.push_back(std::make_unique<TreeTracer<Wide>>());
    tracers.push_back(std::make_unique<TreeTracer<TwoWide>>());
    return tracers;
}

}  // namespace pathscope::bench
