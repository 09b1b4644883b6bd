#include "pathscope/shading/albedo_table.hpp"

#include <array>

#include "pathscope/sampling/sampler.hpp"
#include "pathscope/sampling/warp.hpp"
#include "pathscope/shading/diffuse.hpp"
#include "pathscope/shading/frostbite.hpp"
#include "pathscope/shading/microfacet.hpp"

namespace pathscope {
namespace {

constexpr int k_nodes = 32;
constexpr int k_points = 512;

/// One node by quasi Monte Carlo over Hammersley's points: specular through visible normals, diffuse by
/// cosine.
LobeAlbedos integrate(float cosine, float roughness) {
    const Vec3 outgoing{std::sqrt(1 - cosine * cosine), 0, cosine};
    const float alpha = alpha_from_roughness(roughness);
    LobeAlbedos sum;
    for (std::uint32_t i = 0; i < k_points; ++i) {
        const Vec2 u{(float(i) + 0.5f) / k_points, to_unit_float(reverse_bits(i))};
        if (const Vec3 incoming = sample_ggx_reflection(outgoing, alpha, u); incoming.z > 0) {
            const Vec3 half = normalize(outgoing + incoming);
            const float weight = ggx_distribution(half, alpha) * ggx_visibility(outgoing, incoming, alpha) *
                                 incoming.z / sample_ggx_reflection_pdf(outgoing, half, alpha);
            const float schlick = schlick_weight(dot(outgoing, half));
            sum.scale += weight * (1 - schlick);
            sum.bias += weight * schlick;
        }
        const Vec3 incoming = sample_cosine_hemisphere(u);
        const float cos_difference = dot(outgoing, normalize(outgoing + incoming));
        sum.diffuse += k_pi * eval_frostbite_diffuse(cosine, incoming.z, cos_difference, roughness);
    }
    return {sum.scale / k_points, sum.bias / k_points, sum.diffuse / k_points};
}

/// Nodes are even in the fourth root of the cosine and the square root of the roughness: a smooth surface's
/// masking sets in where the cosine nears alpha, so most happens at grazing angles and low roughness.
float column_of(float cosine) { return std::sqrt(std::sqrt(cosine)) * (k_nodes - 1); }
float row_of(float roughness) { return std::sqrt(roughness) * (k_nodes - 1); }
float cosine_of(int column) { return square(square(float(column) / (k_nodes - 1))); }
float roughness_of(int row) { return square(float(row) / (k_nodes - 1)); }

/// The node at or before x that has another after it. A NaN, as degenerate geometry makes them, gives node 0:
/// what comes out is a NaN as well, but what is read is the table.
int node_below(float x) { return int(std::min(std::max(0.0f, x), float(k_nodes - 2))); }

struct Table {
    std::array<std::array<LobeAlbedos, k_nodes>, k_nodes> nodes;

    Table() {
        for (int row = 0; row < k_nodes; ++row)
            for (int column = 0; column < k_nodes; ++column)
                nodes[row][column] = integrate(std::max(cosine_of(column), 1e-5f), roughness_of(row));
    }
};

LobeAlbedos mix(const LobeAlbedos& a, const LobeAlbedos& b, float t) {
    return {lerp(a.scale, b.scale, t), lerp(a.bias, b.bias, t), lerp(a.diffuse, b.diffuse, t)};
}

}  // namespace

AlbedoRow::AlbedoRow(float roughness) {
    static const Table table;
    const float y = row_of(roughness);
    const int row = node_below(y);
    low_ = table.nodes[row].data();
    high_ = table.nodes[row + 1].data();
    between_ = y - float(row);
}

LobeAlbedos AlbedoRow::at(float cosine) const {
    const float x = column_of(cosine);
    const int column = node_below(x);
    return mix(mix(low_[column], high_[column], between_), mix(low_[column + 1], high_[column + 1], between_),
               x - float(column));
}

}  // namespace pathscope
