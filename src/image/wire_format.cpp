#include "pathscope/image/wire_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <optional>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_exponent_bytes = 1;

/// x / 2^shift to the nearest integer, ties to even.
std::uint64_t round_shift(std::uint64_t x, int shift) {
    if (shift <= 0) return x << -shift;
    const std::uint64_t whole = x >> shift;
    const std::uint64_t rest = x & ((std::uint64_t{1} << shift) - 1), half = std::uint64_t{1} << (shift - 1);
    return whole + (rest > half || (rest == half && (whole & 1) == 1));
}

int width_of(std::uint64_t x) { return int(std::bit_width(x)); }

std::uint64_t brightest_of(const PixelSum& sum) { return std::uint64_t(std::max({sum.r, sum.g, sum.b})); }

/// Half floats. The brightest sum is put into [2^14, 2^15): the largest half is 65504.
struct Half {
    static constexpr int k_top = 15, k_mantissa = 11, k_finest = -24;  ///< The smallest half is 2^-24.
    static constexpr int k_max_exponent = 63 - k_top;
    static constexpr std::size_t k_bytes = 2, k_codes = 3;  ///< Of a code; of a pixel.

    static std::uint32_t code(std::uint64_t sum, int e) {
        if (sum == 0) return 0;
        const int shift = std::max(width_of(sum) - k_mantissa, e + k_finest);
        // Added and not joined: a mantissa that is rounded up to 2^11 carries into the exponent, as it should.
        const auto exponent = std::uint32_t(shift - (e + k_finest));
        return (exponent << 10) + std::uint32_t(round_shift(sum, shift));
    }
    static std::array<std::uint32_t, k_codes> codes(const PixelSum& sum, int e) {
        return {code(std::uint64_t(sum.r), e), code(std::uint64_t(sum.g), e), code(std::uint64_t(sum.b), e)};
    }

    /// Nothing for a sign, an infinity, and what is not a number.
    static std::optional<std::uint64_t> value(std::uint32_t code, int e) {
        const int biased = int(code >> 10);
        if (biased >= 31) return std::nullopt;
        const std::uint64_t mantissa = (code & 1023) + (biased > 0 ? 1024 : 0);
        return round_shift(mantissa, -(std::max(biased, 1) - 1 + e + k_finest));
    }
    static std::optional<std::array<std::uint64_t, 3>> values(const std::array<std::uint32_t, k_codes>& codes,
                                                              int e) {
        const auto r = value(codes[0], e), g = value(codes[1], e), b = value(codes[2], e);
        if (!r || !g || !b) return std::nullopt;
        return std::array{*r, *g, *b};
    }
};

/// Red, green, blue in nine bits each, from the lowest on, and the exponent in the upper five.
struct Shared {
    static constexpr int k_mantissa = 9, k_top = k_mantissa + 30;
    static constexpr int k_max_exponent = 63 - k_top;
    static constexpr std::size_t k_bytes = 4, k_codes = 1;
    static constexpr std::uint32_t k_most = (1u << k_mantissa) - 1;

    static std::array<std::uint32_t, k_codes> codes(const PixelSum& sum, int e) {
        const int own = std::max(0, width_of(brightest_of(sum)) - k_mantissa - e);
        // Cut off at the most and not carried: a doubled step would cost the other channels more than this costs.
        const auto mantissa = [&](std::int64_t quanta) {
            return std::min(k_most, std::uint32_t(round_shift(std::uint64_t(quanta), own + e)));
        };
        return {mantissa(sum.r) | mantissa(sum.g) << 9 | mantissa(sum.b) << 18 | std::uint32_t(own) << 27};
    }
    static std::optional<std::array<std::uint64_t, 3>> values(const std::array<std::uint32_t, k_codes>& codes,
                                                              int e) {
        const auto channel = [&](int at) {
            return std::uint64_t(codes[0] >> at & k_most) << ((codes[0] >> 27) + std::uint32_t(e));
        };
        return std::array{channel(0), channel(9), channel(18)};
    }
};

/// What was rounded up past the most that the samples can add up to is that; what lies farther beyond was never rounded.
std::optional<std::int64_t> settle(std::uint64_t quanta, std::uint64_t most) {
    if (quanta > most && quanta - most > most >> 8) return std::nullopt;
    return std::int64_t(std::min(quanta, most));
}

/// The exponent of the block, then all lowest bytes of the codes, all next ones...
template <class Format>
std::string write(std::span<const PixelSum> sums) {
    std::uint64_t brightest = 0;
    for (const PixelSum& sum : sums) {
        CHECK(sum.r >= 0 && sum.g >= 0 && sum.b >= 0, sum.r, sum.g, sum.b);
        brightest = std::max(brightest, brightest_of(sum));
    }
    const int e = std::max(0, width_of(brightest) - Format::k_top);
    const std::size_t count = sums.size() * Format::k_codes;
    std::string bytes(k_exponent_bytes + count * Format::k_bytes, '\0');
    bytes[0] = char(e);
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const auto codes = Format::codes(sums[i], e);
        for (std::size_t c = 0; c < Format::k_codes; ++c)
            for (std::size_t byte = 0; byte < Format::k_bytes; ++byte)
                bytes[k_exponent_bytes + byte * count + i * Format::k_codes + c] = char(codes[c] >> 8 * byte);
    }
    return bytes;
}

template <class Format>
Result<void> read(std::string_view bytes, std::uint32_t samples, std::span<PixelSum> sums) {
    const int e = std::uint8_t(bytes[0]);
    if (e > Format::k_max_exponent)
        return bad_input(
            fmt::format("The exponent of the block is {}, more than {}.", e, Format::k_max_exponent));
    if (samples > k_max_samples_per_pixel) return bad_input(fmt::format("No sum has {} samples.", samples));
    const std::uint64_t most = std::uint64_t(k_max_quanta) * samples;
    const std::size_t count = sums.size() * Format::k_codes;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        std::array<std::uint32_t, Format::k_codes> codes{};
        for (std::size_t c = 0; c < Format::k_codes; ++c)
            for (std::size_t byte = 0; byte < Format::k_bytes; ++byte)
                codes[c] |= std::uint32_t(std::uint8_t(
                                bytes[k_exponent_bytes + byte * count + i * Format::k_codes + c]))
                            << 8 * byte;
        const auto values = Format::values(codes, e);
        if (!values) return bad_input("A sum is negative, infinite or not a number.");
        const auto r = settle((*values)[0], most), g = settle((*values)[1], most),
                   b = settle((*values)[2], most);
        if (!r || !g || !b)
            return bad_input(fmt::format("A sum is beyond what {} samples can add up to.", samples));
        sums[i] = {*r, *g, *b};
    }
    return {};
}

}  // namespace

std::size_t wire_bytes(WireFormat format, std::size_t pixels) {
    switch (format) {
        case WireFormat::exact:
            return pixels * sizeof(PixelSum);
        case WireFormat::half:
            return k_exponent_bytes + pixels * Half::k_codes * Half::k_bytes;
        case WireFormat::shared:
            return k_exponent_bytes + pixels * Shared::k_codes * Shared::k_bytes;
    }
    return 0;
}

std::string round_sums(WireFormat format, std::span<const PixelSum> sums) {
    CHECK(format != WireFormat::exact);
    return format == WireFormat::half ? write<Half>(sums) : write<Shared>(sums);
}

Result<void> read_rounded_sums(WireFormat format, std::string_view bytes, std::uint32_t count,
                               std::span<PixelSum> sums) {
    CHECK(format != WireFormat::exact && bytes.size() == wire_bytes(format, sums.size()), bytes.size());
    return format == WireFormat::half ? read<Half>(bytes, count, sums) : read<Shared>(bytes, count, sums);
}

}  // namespace pathscope
