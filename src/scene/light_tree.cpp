#include "pathscope/scene/light_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// Cosines this near to a horizon may be on either side of it, by rounding. It is the least cosine as well: what can just
/// be reached is picked seldom, but never so seldom that its sample outshines the picture.
constexpr float k_cosine_slack = 1e-3f;

constexpr float k_least_importance = std::numeric_limits<float>::min();

/// From here on, halves: 2^22 lights need 22 levels more.
constexpr int k_deepest_cut = 40;
constexpr int k_deepest = 64;

float sine_of(float cosine) { return std::sqrt(std::max(0.0f, 1 - cosine * cosine)); }

// ---- Four children at once, in the compiler's own vectors: one text for every machine.

constexpr std::size_t k_lanes = 4;
using Four [[gnu::vector_size(4 * sizeof(float))]] = float;

Four all(float a) { return Four{} + a; }
Four load(const float* four) { return Four{four[0], four[1], four[2], four[3]}; }
void store(float* four, Four a) {
    for (std::size_t i = 0; i < k_lanes; ++i) four[i] = a[i];
}
Four larger(Four a, Four b) { return a > b ? a : b; }
Four smaller(Four a, Four b) { return a < b ? a : b; }
Four square_root(Four a) { return Four{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])}; }

struct Angle {
    Four cosine, sine;
};

Angle angle_of(Four cosine) {
    const Four within = smaller(larger(cosine, all(-1)), all(1));
    return {within, square_root(1 - within * within)};
}

/// max(0, a - b), of angles from 0 to π.
Angle reduced(const Angle& a, const Angle& b) {
    const auto none = a.cosine >= b.cosine;
    return {none ? all(1) : a.cosine * b.cosine + a.sine * b.sine,
            none ? all(0) : a.sine * b.cosine - a.cosine * b.sine};
}

// ---- The build.

/// What a set of lights is to the cost of a split. A box around the normals stands for their cone: boxes of sets add up.
struct Extent {
    Box box, normals;
    bool everywhere = false;
    double intensity = 0;

    void add(const LightBounds& light) {
        box.add(light.box);
        intensity += light.intensity;
        if (light.side == ShinesTo::everywhere)
            everywhere = true;
        else
            normals.add(upright(light));
    }
    void add(const Extent& other) {
        box.add(other.box);
        normals.add(other.normals);
        everywhere |= other.everywhere;
        intensity += other.intensity;
    }

    /// Of the two normals of a light that shines to both sides, always the same one.
    static Vec3 upright(const LightBounds& light) {
        const Vec3 n = light.normal;
        const bool flip = n.z < 0 || (n.z == 0 && (n.y < 0 || (n.y == 0 && n.x < 0)));
        return light.side == ShinesTo::both_sides && flip ? -n : n;
    }

    /// The middle of the normals; nothing if there is none.
    [[nodiscard]] std::optional<Vec3> axis() const {
        if (everywhere || normals.empty()) return std::nullopt;
        const Vec3 middle = normals.centre();
        const float size = length(middle);
        if (!(size > 0.01f)) return std::nullopt;
        return middle / size;
    }

    /// Intensity, times the directions it goes to, times the square of the box's radius.
    ///
    ///   directions = π (1 + 3 sin(cone / 2)):     π for a plane, 4π for a sphere, and nearly Conty's integral between
    [[nodiscard]] double cost() const {
        double cosine = -1;
        if (const auto along = axis())
            cosine = std::clamp(dot(*along, normals.centre()) - dot(abs(*along), normals.extent() * 0.5f),
                                -1.0f, 1.0f);
        const Vec3 diagonal = box.extent();
        return intensity * (1 + 3 * std::sqrt((1 - cosine) / 2)) * double(length_squared(diagonal));
    }
};

}  // namespace

/// Top down: a set of lights is cut in two, and the costliest part again, until there are eight.
class LightTreeBuilder {
  public:
    explicit LightTreeBuilder(std::span<const LightBounds> lights) : lights_(lights), order_(lights.size()) {
        std::iota(order_.begin(), order_.end(), 0u);
        for (const LightBounds& light : lights) tree_.intensity_ += light.intensity;
        tree_.place_of_.resize(lights.size());
        if (!lights.empty()) build(part_of(0, lights.size(), 0), 0);
    }
    [[nodiscard]] LightTree take() { return std::move(tree_); }

  private:
    /// Part of order_, and how often it was cut.
    struct Part {
        std::size_t begin, end;
        int depth;
        Extent extent;
        [[nodiscard]] std::size_t size() const { return end - begin; }
        [[nodiscard]] double cost() const { return size() > 1 ? extent.cost() : -1; }
    };

    /// A cut through the centres, between two of k_bins slices.
    struct Cut {
        int axis = 0, first_bins = 0;
        double cost = std::numeric_limits<double>::infinity();
    };

    static constexpr int k_bins = 12;

    static Vec3 centre(const LightBounds& light) { return light.box.centre(); }
    [[nodiscard]] const LightBounds& light_at(std::size_t i) const { return lights_[order_[i]]; }

    [[nodiscard]] Part part_of(std::size_t begin, std::size_t end, int depth) const {
        Part part{begin, end, depth, {}};
        for (std::size_t i = begin; i < end; ++i) part.extent.add(light_at(i));
        return part;
    }

    std::uint32_t build(const Part& part, std::uint32_t place) {
        const auto index = std::uint32_t(tree_.nodes_.size());
        tree_.nodes_.emplace_back();
        tree_.nodes_[index].place = place;
        const std::vector<Part> parts = cut_to_children(part);
        for (std::uint32_t i = 0; i < parts.size(); ++i) {
            describe(tree_.nodes_[index], i, parts[i]);
            const std::uint32_t here = LightTree::place(index, i);
            if (parts[i].size() == 1) {
                const std::uint32_t light = order_[parts[i].begin];
                tree_.nodes_[index].child[i] = light;
                tree_.place_of_[light] = here;
            } else {
                const std::uint32_t child = build(parts[i], here);
                tree_.nodes_[index].child[i] = child;
            }
        }
        return index;
    }

    std::vector<Part> cut_to_children(const Part& whole) {
        std::vector<Part> parts{whole};
        while (parts.size() < LightTree::k_children) {
            const auto costliest = std::max_element(
                parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.cost() < b.cost(); });
            if (costliest->size() == 1) break;
            const Part old = *costliest;
            const std::size_t middle = cut(old);
            *costliest = part_of(old.begin, middle, old.depth + 1);
            parts.insert(costliest + 1, part_of(middle, old.end, old.depth + 1));
        }
        return parts;
    }

    void describe(LightTree::Node& node, std::uint32_t child, const Part& part) const {
        const Vec3 middle = part.extent.box.centre(), half = part.extent.box.extent() * 0.5f;
        for (int axis = 0; axis < 3; ++axis) {
            node.centre[std::size_t(axis)][child] = middle[axis];
            node.half_extent[std::size_t(axis)][child] = half[axis];
        }
        node.radius[child] = length(half);
        node.intensity[child] = std::max(float(part.extent.intensity / tree_.intensity_), k_least_importance);
        node.count[child] = std::uint32_t(part.size());
        node.back[child] = any_shines_back(part) ? -1.0f : 1.0f;
        node.cos_cone[child] = -1;
        if (const auto along = part.extent.axis()) {
            for (int axis = 0; axis < 3; ++axis) node.normal[std::size_t(axis)][child] = (*along)[axis];
            node.cos_cone[child] = cone_around(*along, part);
            node.sin_cone[child] = sine_of(node.cos_cone[child]);
        }
    }

    [[nodiscard]] bool any_shines_back(const Part& part) const {
        for (std::size_t i = part.begin; i < part.end; ++i)
            if (light_at(i).side == ShinesTo::both_sides) return true;
        return false;
    }

    /// The cosine of the cone that holds all normals, a hair wider than they are.
    [[nodiscard]] float cone_around(Vec3 axis, const Part& part) const {
        constexpr float k_hair = 1e-6f;
        float cosine = 1;
        for (std::size_t i = part.begin; i < part.end; ++i)
            cosine = std::min(cosine, dot(axis, Extent::upright(light_at(i))));
        return std::max(cosine - k_hair, -1.0f);
    }

    /// Reorders the part and returns where its second half begins.
    std::size_t cut(const Part& part) {
        Box centres;
        for (std::size_t i = part.begin; i < part.end; ++i) centres.add(centre(light_at(i)));
        Cut best;
        if (part.depth < k_deepest_cut)
            for (int axis = 0; axis < 3; ++axis) consider_cuts(part, centres, axis, best);
        if (!std::isfinite(best.cost)) return part.begin + part.size() / 2;
        const auto at = [&](std::size_t i) { return order_.begin() + std::ptrdiff_t(i); };
        const auto middle = std::stable_partition(at(part.begin), at(part.end), [&](std::uint32_t light) {
            return bin_of(lights_[light], centres, best.axis) < best.first_bins;
        });
        return std::size_t(middle - order_.begin());
    }

    static int bin_of(const LightBounds& light, const Box& centres, int axis) {
        const float place = (centre(light)[axis] - centres.low[axis]) / centres.extent()[axis];
        return std::clamp(int(place * k_bins), 0, k_bins - 1);
    }

    void consider_cuts(const Part& part, const Box& centres, int axis, Cut& best) const {
        if (!(centres.extent()[axis] > 0)) return;
        std::array<Extent, k_bins> bins;
        for (std::size_t i = part.begin; i < part.end; ++i)
            bins[std::size_t(bin_of(light_at(i), centres, axis))].add(light_at(i));
        // Long boxes are cut across first (Conty's regularisation).
        const Vec3 size = centres.extent();
        const double slenderness = double(max_component(size)) / size[axis];
        for (int first_bins = 1; first_bins < k_bins; ++first_bins) {
            Extent first, second;
            for (int bin = 0; bin < k_bins; ++bin)
                (bin < first_bins ? first : second).add(bins[std::size_t(bin)]);
            if (first.box.empty() || second.box.empty()) continue;
            const double cost = slenderness * (first.cost() + second.cost());
            if (cost < best.cost) best = {axis, first_bins, cost};
        }
    }

    std::span<const LightBounds> lights_;
    std::vector<std::uint32_t> order_;
    LightTree tree_;
};

LightTree LightTree::make(std::span<const LightBounds> lights) {
    CHECK(lights.size() <= k_most_lights, lights.size());
    return LightTreeBuilder(lights).take();
}

LightTree::PerChild<float> LightTree::importances(const Node& node, const LightReference& reference) {
    const Vec3 p = reference.position, n = reference.normal, n_abs = abs(reference.normal);
    PerChild<float> result;
    for (std::size_t from = 0; from < k_children; from += k_lanes) {
        const auto four = [from](const PerChild<float>& values) { return load(values.data() + from); };
        const Four x = four(node.centre[0]) - p.x, y = four(node.centre[1]) - p.y,
                   z = four(node.centre[2]) - p.z;
        const Four radius = four(node.radius);
        // The point may be among the lights: then it is as far as the box is large, and any angle is possible.
        const Four near_squared = larger(radius * radius, all(k_least_importance));
        const Four squared = larger(x * x + y * y + z * z, near_squared);
        const Four distance = square_root(squared), inverse = 1 / distance;
        const Four sine = radius * inverse, cosine = square_root(larger(1 - sine * sine, all(0)));
        const Angle subtended{squared <= near_squared ? all(-1) : cosine, sine};

        const Four height = n.x * x + n.y * y + n.z * z;
        const Angle received = reduced(angle_of(height * inverse), subtended);

        const Four facing =
            -(four(node.normal[0]) * x + four(node.normal[1]) * y + four(node.normal[2]) * z) * inverse;
        const Angle off_axis = angle_of(larger(facing, facing * four(node.back)));
        const Angle emitted =
            reduced(reduced(off_axis, {four(node.cos_cone), four(node.sin_cone)}), subtended);

        const Four intensity = four(node.intensity);
        const Four value = intensity * larger(received.cosine, all(k_cosine_slack)) *
                           larger(emitted.cosine, all(k_cosine_slack)) / squared;
        // The highest corner of the box decides whether any of it is above the horizon.
        const Four highest = height + n_abs.x * four(node.half_extent[0]) +
                             n_abs.y * four(node.half_extent[1]) + n_abs.z * four(node.half_extent[2]);
        const auto reached = (highest >= -k_cosine_slack * (distance + radius)) &
                             (emitted.cosine >= -k_cosine_slack) & (intensity > 0);
        store(result.data() + from, reached ? larger(value, all(k_least_importance)) : all(0));
    }
    return result;
}

LightTree::PerChild<std::uint32_t> LightTree::share_out(const Node& node, const LightReference& reference,
                                                        std::uint32_t steps) {
    const PerChild<float> importance = importances(node, reference);
    float total = 0;
    std::uint32_t reserved = 0;
    for (std::size_t i = 0; i < k_children; ++i) {
        total += importance[i];
        reserved += importance[i] > 0 ? node.count[i] : 0;
    }
    PerChild<std::uint32_t> ends{};
    if (!(total > 0)) return ends;
    // By rounding a step or two may be left at the end. They lead nowhere, as reported.
    const float shared = float(steps - reserved), inverse = 1 / total;
    float sum = 0;
    std::uint32_t seen = 0;
    for (std::size_t i = 0; i < k_children; ++i) {
        sum += importance[i];
        seen += importance[i] > 0 ? node.count[i] : 0;
        ends[i] = seen + std::uint32_t(std::min(sum * inverse, 1.0f) * shared);
    }
    return ends;
}

std::optional<LightTree::Pick> LightTree::pick(const LightReference& reference, std::uint32_t step,
                                               std::uint32_t steps) const {
    CHECK(step < steps && steps >= light_count(), step, steps, light_count());
    if (light_count() == 1) return Pick{0, steps};
    for (const Node* node = nodes_.data();;) {
        const PerChild<std::uint32_t> ends = share_out(*node, reference, steps);
        std::uint32_t child = 0;
        while (child < k_children && step >= ends[child]) ++child;
        if (child == k_children) return std::nullopt;
        const std::uint32_t begin = child > 0 ? ends[child - 1] : 0;
        step -= begin;
        steps = ends[child] - begin;
        if (node->count[child] == 1) return Pick{node->child[child], steps};
        node = &nodes_[node->child[child]];
    }
}

std::uint32_t LightTree::steps_to(const LightReference& reference, std::uint32_t light,
                                  std::uint32_t steps) const {
    CHECK(light < light_count() && steps >= light_count(), light, steps, light_count());
    if (light_count() == 1) return steps;
    // The way up, and then down along it.
    std::array<std::uint32_t, k_deepest> way;
    std::size_t length = 0;
    for (std::uint32_t at = place_of_[light];; at = nodes_[at / k_children].place) {
        way[length++] = at;
        if (at / k_children == 0) break;
    }
    while (length > 0 && steps > 0) {
        const std::uint32_t at = way[--length], child = at % k_children;
        const PerChild<std::uint32_t> ends = share_out(nodes_[at / k_children], reference, steps);
        steps = ends[child] - (child > 0 ? ends[child - 1] : 0);
    }
    return steps;
}

double LightTree::irradiance(const LightReference& reference) const {
    double sum = 0;
    for (const float importance : importances(nodes_.front(), reference)) sum += importance;
    return sum * intensity_;
}

}  // namespace pathscope
