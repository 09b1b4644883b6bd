#pragma once
/// Either of the two trees, behind one interface.
///
/// two_wide   bvh.hpp: the textbook's, which lessons step through and which tests compare with;
/// wide       wide_bvh.hpp: the fast one, which renders.
///
/// Both give the same answers, bit for bit, so which one is used is no part of what is rendered: client and servers may
/// differ in it.
///
/// Thread safety: building is pure; a Tree is read by any number of threads.   Test: tests/bvh/test_wide.cpp

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>

#include "pathscope/bvh/bvh.hpp"
#include "pathscope/bvh/traverse.hpp"
#include "pathscope/bvh/wide_bvh.hpp"
#include "pathscope/bvh/wide_traverse.hpp"
#include "pathscope/core/enum_names.hpp"

namespace pathscope {

enum class TreeKind : std::uint8_t { two_wide, wide };
inline constexpr std::array k_tree_kind_names{
    EnumName{TreeKind::two_wide, "two-wide"},
    EnumName{TreeKind::wide, "wide"},
};
constexpr const auto& enum_table(TreeKind) { return k_tree_kind_names; }

using Tree = std::variant<Bvh, WideBvh>;

/// threads: 0 = all cores.
[[nodiscard]] inline Tree build_tree(const Mesh& mesh, TreeKind kind, int threads = 0) {
    if (kind == TreeKind::wide) return build_wide_bvh(mesh, {}, threads);
    return build_bvh(mesh, {}, threads);
}

/// Of nodes and triangles.
[[nodiscard]] inline std::size_t tree_bytes(const Tree& tree) {
    if (const auto* wide = std::get_if<WideBvh>(&tree)) return wide_bvh_stats(*wide).bytes;
    return bvh_stats(std::get<Bvh>(tree)).bytes;
}

template <class Accept = AcceptAll>
[[nodiscard]] std::optional<Hit> closest_hit(const Tree& tree, const Ray& ray, const Accept& accept = {}) {
    if (const auto* wide = std::get_if<WideBvh>(&tree)) return closest_hit(*wide, ray, accept);
    return closest_hit(*std::get_if<Bvh>(&tree), ray, accept);
}

/// The same, counted.
template <class Accept>
[[nodiscard]] std::optional<Hit> closest_hit(const Tree& tree, const Ray& ray, const Accept& accept,
                                             TraversalCounts& counts) {
    if (const auto* wide = std::get_if<WideBvh>(&tree)) return closest_hit(*wide, ray, accept, counts);
    return closest_hit(*std::get_if<Bvh>(&tree), ray, accept, counts);
}

/// closest[i] = closest_hit(tree, rays[i], accept): wide_traverse.hpp.
template <class Accept = AcceptAll>
void closest_hits(const Tree& tree, std::span<const Ray> rays, std::span<std::optional<Hit>> closest,
                  const Accept& accept = {}) {
    if (const auto* wide = std::get_if<WideBvh>(&tree)) return closest_hits(*wide, rays, closest, accept);
    for (std::size_t i = 0; i < rays.size(); ++i)
        closest[i] = closest_hit(*std::get_if<Bvh>(&tree), rays[i], accept);
}

template <class Accept = AcceptAll>
[[nodiscard]] bool any_hit(const Tree& tree, const Ray& ray, const Accept& accept = {}) {
    if (const auto* wide = std::get_if<WideBvh>(&tree)) return any_hit(*wide, ray, accept);
    return any_hit(*std::get_if<Bvh>(&tree), ray, accept);
}

/// any_hit(tree, ray, accept), sooner where rays before it were stopped by the same things: wide_traverse.hpp.
template <class Accept>
[[nodiscard]] bool any_hit(const Tree& tree, const Ray& ray, const Accept& accept, OccluderCache& occluders) {
    if (const auto* wide = std::get_if<WideBvh>(&tree)) return any_hit(*wide, ray, accept, occluders);
    return any_hit(*std::get_if<Bvh>(&tree), ray, accept);
}

}  // namespace pathscope
