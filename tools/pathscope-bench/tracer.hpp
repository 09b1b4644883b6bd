#pragma once
/// A tracer: one way to answer rays, ours or a peer's, behind one interface that costs nothing per ray.
///
/// A tracer builds its tree, and offers *calls* for a set of rays: functions from a batch of rays to as many
/// answers. The indirection is one per batch of k_batch_rays; inside, each tracer converts to its own types and inlines
/// what it can, so that the conversion is a part of what is measured, as it is in a renderer.
///
/// To add a tree of ours: a policy of a few lines in our_tracers.cpp.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "measure.hpp"
#include "pathscope/bvh/traversal_probe.hpp"
#include "pathscope/geometry/mesh.hpp"
#include "pathscope/math/ray.hpp"
#include "ray_sets.hpp"

namespace pathscope::bench {

inline constexpr std::size_t k_batch_rays = 4096;
inline constexpr std::uint32_t k_no_answer = 0xffffffffu;

/// For RayQuery::any, `triangle` is 0 where anything is hit, and t means nothing.
struct Answer {
    float t = k_infinity;
    std::uint32_t triangle = k_no_answer;

    [[nodiscard]] bool hit() const { return triangle != k_no_answer; }
};

/// Answers rays[i] in answers[i]. Requires: at most k_batch_rays of them. Thread safety: yes.
using TraceBatch = std::function<void(std::span<const Ray> rays, std::span<Answer> answers)>;

struct TraceCall {
    std::string name;
    TraceBatch trace;
    /// False for what is measured beside, for the record: it is never the rival that a ratio names.
    bool is_rival = true;
};

class Tracer {
  public:
    virtual ~Tracer() = default;

    [[nodiscard]] virtual std::string name() const = 0;

    /// Replaces the tree; gives what it took, without throwing the old one away.
    [[nodiscard]] virtual Cost build(const Mesh& mesh, int threads) = 0;
    /// Of the tree; the mesh that it was built from is not counted.
    [[nodiscard]] virtual std::size_t bytes() const = 0;

    /// At least one that is a rival. The first answers one ray at a time. They refer to this tracer and its present tree.
    [[nodiscard]] virtual std::vector<TraceCall> calls(RayQuery query, bool coherent) const = 0;

    /// What the first call visits on its way; nothing if the tracer does not tell.
    [[nodiscard]] virtual std::optional<TraversalCounts> count(RayQuery query,
                                                               std::span<const Ray> rays) const = 0;
};

/// All trees of the project, the one that renders first.
[[nodiscard]] std::vector<std::unique_ptr<Tracer>> make_our_tracers();

/// Nothing if this program was built without Embree.
[[nodiscard]] std::unique_ptr<Tracer> make_embree_tracer();

}  // namespace pathscope::bench
