#pragma once
/// A tree over many lights: from the point that is lit, pick those that matter there.
///
///   importance = I cos θ' cos θi' / d²        the irradiance that a node of intensity I might send here
///   P(child)   = importance / (sum over the node's children)
///
/// Why: by power alone a lamp at the far end of a building is drawn as often as the one overhead, and each light costs the
/// same whether it faces the point or not. A node knows a box around its lights, a cone around their normals, and the sum of
/// their intensities; so a walk from the root to a leaf, a few steps of arithmetic each, goes where light is to be expected.
/// Never too dark: an angle counts as the least that any point of the box may have, θ' = max(0, θ - cone - angle that the box
/// subtends), and d is at least the box's radius. So a child is left out only where all of its lights lie below the horizon
/// of the point or turn their backs on it.
/// Eight children per node: their importances are eight lanes of the same arithmetic, for which compilers have instructions.
/// Exactly what is reported is what happens: uniform numbers are multiples of 2^-24, and each child is given a whole number
/// of these steps, one at least for each of its lights (as in sampling/distribution.hpp). P(light) is its steps by all steps.
/// The build asks for no sine, no cosine and no thread: the same tree, the same picks, on every machine.
/// Not done: samples of several subtrees at once (the "adaptive splitting" of the paper); several samples per vertex, spread
/// over the tree by their lattice, serve the same purpose (integrator/direct_light.hpp).
/// What it buys against picking by power (32 samples, relative variance times processor time): a factor of 1.2 in the
/// conference room (12 lights), 1.3 for Veach's spheres, 1.4 for four lamps over plates, and 15 in a house of 192 lamps
/// behind walls.
///
/// Units: scene units; intensity W/sr, as luminance.
/// See: Conty Estevez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"; the BVHLightSampler of
/// pbrt-v4, whose measure of a cone is this one up to its approximation without trigonometry.
/// Thread safety: const after make().   Test: tests/scene/test_light_tree.cpp

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pathscope/math/box.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

/// The point that is lit. The normal is the shading normal on the side of the viewer, of length one. Surfaces scatter
/// towards that side only; what passes them passes straight, and needs no light sample.
struct LightReference {
    Vec3 position;
    Vec3 normal;
};

enum class ShinesTo { front, both_sides, everywhere };

/// Where a light is and whither it shines.
struct LightBounds {
    Box box;
    Vec3 normal{0, 0, 1};  ///< Of length one; of no meaning for `everywhere`.
    ShinesTo side = ShinesTo::everywhere;
    double intensity = 0;  ///< Along the normal: radiance times area. > 0
};

class LightTree {
  public:
    static constexpr std::uint32_t k_most_lights = 1u << 22;

    struct Pick {
        std::uint32_t light = 0;  ///< The index of its bounds.
        std::uint32_t steps = 0;  ///< That lead to it, of those given. > 0
    };

    /// Requires: at most k_most_lights.
    [[nodiscard]] static LightTree make(std::span<const LightBounds> lights);

    /// The light at one of `steps` steps; nothing if no light can reach the point.
    /// Requires: not empty; step < steps; steps >= light_count().
    [[nodiscard]] std::optional<Pick> pick(const LightReference& reference, std::uint32_t step,
                                           std::uint32_t steps) const;

    /// How many of `steps` lead to the light. Requires: as pick(); light < light_count().
    [[nodiscard]] std::uint32_t steps_to(const LightReference& reference, std::uint32_t light,
                                         std::uint32_t steps) const;

    /// About the irradiance by all lights, if nothing stands between. Requires: not empty.
    [[nodiscard]] double irradiance(const LightReference& reference) const;

    [[nodiscard]] bool empty() const { return nodes_.empty(); }
    [[nodiscard]] std::uint32_t light_count() const { return std::uint32_t(place_of_.size()); }

  private:
    friend class LightTreeBuilder;

    static constexpr std::uint32_t k_children = 8;
    template <class T>
    using PerChild = std::array<T, k_children>;

    struct alignas(32) Node {
        std::array<PerChild<float>, 3> centre{}, half_extent{};  ///< Of the box, by axis.
        std::array<PerChild<float>, 3> normal{};                 ///< The axis of the cone of normals.
        PerChild<float> cos_cone{}, sin_cone{};  ///< Of its half angle; cosine -1 shines everywhere.
        PerChild<float> back{};                  ///< -1 if the back shines as the front does, else 1.
        PerChild<float> radius{};                ///< Of the box.
        PerChild<float> intensity{};             ///< Of the tree's; 0 where there is no child.
        PerChild<std::uint32_t> count{};         ///< Lights.
        PerChild<std::uint32_t> child{};         ///< A node; where there is one light, that.
        std::uint32_t place = 0;                 ///< Of the node in its parent.
    };

    /// A child of a node, as one number.
    static std::uint32_t place(std::uint32_t node, std::uint32_t child) { return node * k_children + child; }

    [[nodiscard]] static PerChild<float> importances(const Node& node, const LightReference& reference);
    /// Where the steps of each child end; all 0 if none can be reached.
    [[nodiscard]] static PerChild<std::uint32_t> share_out(const Node& node, const LightReference& reference,
                                                           std::uint32_t steps);

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> place_of_;  ///< Of each light.
    double intensity_ = 0;
};

}  // namespace pathscope
