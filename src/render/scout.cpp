#include "pathscope/render/scout.hpp"

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// Calls visit(block, sum0, sum1) for each channel of each pixel, row by row.
template <class Visit>
void visit_channels(const FrameSums& half0, const FrameSums& half1, Visit&& visit) {
    CHECK(half0.grid() == half1.grid() && half0.quantum() == half1.quantum());
    const BlockGrid& grid = half0.grid();
    for (int y = 0; y < grid.height(); ++y)
        for (int x = 0; x < grid.width(); ++x) {
            const std::uint32_t block = grid.block_at(x, y);
            CHECK(half0.samples_of_block(block) > 0 && half1.samples_of_block(block) > 0, block);
            const PixelSum& a = half0.sum_at(x, y);
            const PixelSum& b = half1.sum_at(x, y);
            visit(block, a.r, b.r);
            visit(block, a.g, b.g);
            visit(block, a.b, b.b);
        }
}

}  // namespace

std::vector<double> variance_of_blocks(const FrameSums& half0, const FrameSums& half1) {
    const double q = detail::power_of_two(half0.quantum().exponent);
    std::vector<double> variance(half0.grid().count(), 0.0);
    visit_channels(half0, half1, [&](std::uint32_t block, std::int64_t a, std::int64_t b) {
        const double n0 = half0.samples_of_block(block), n1 = half1.samples_of_block(block);
        const double difference = (double(a) / n0 - double(b) / n1) * q;
        variance[block] += difference * difference / (1 / n0 + 1 / n1);
    });
    return variance;
}

double mean_radiance(const FrameSums& half0, const FrameSums& half1) {
    const double q = detail::power_of_two(half0.quantum().exponent);
    double sum = 0;
    std::uint64_t channels = 0;
    visit_channels(half0, half1, [&](std::uint32_t block, std::int64_t a, std::int64_t b) {
        const double samples = double(half0.samples_of_block(block)) + double(half1.samples_of_block(block));
        sum += (double(a) + double(b)) / samples * q;
        ++channels;
    });
    return channels > 0 ? sum / double(channels) : 0;
}

}  // namespace pathscope
