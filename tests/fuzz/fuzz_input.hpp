#pragma once
/// Any bytes, read as decisions: which step comes next, which number, how long a text.
///
/// Every run of bytes is a valid script, and its end reads as zeros, so a fuzzer can change, cut and join scripts and
/// none is wasted. Numbers are mostly small; a byte of 0xC0 and above stands for one at which arithmetic breaks, or says
/// that the number follows in full.

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace pathscope::fuzz {

inline constexpr std::array<std::uint64_t, 16> k_edges{
    0xff,
    0x100,
    0xffff,
    0x1'0000,
    0x10'0000,
    0x7fff'ffff,
    0x8000'0000,
    0xffff'ffff,
    0x1'0000'0000,
    0xffff'ffff'ffff,
    std::uint64_t{1} << 60,
    std::uint64_t{1} << 61,
    0x7fff'ffff'ffff'ffff,
    0x8000'0000'0000'0000,
    0xffff'ffff'ffff'fffe,
    0xffff'ffff'ffff'ffff,
};

class FuzzInput {
  public:
    explicit FuzzInput(std::string_view bytes) : rest_(bytes) {}

    [[nodiscard]] bool empty() const { return rest_.empty(); }
    [[nodiscard]] std::string_view rest() const { return rest_; }

    std::uint8_t byte() {
        if (rest_.empty()) return 0;
        const auto value = static_cast<std::uint8_t>(rest_.front());
        rest_.remove_prefix(1);
        return value;
    }
    bool flag() { return byte() % 2 == 1; }
    /// One of 0 .. n - 1. Requires: 0 < n <= 256.
    std::size_t below(std::size_t n) { return byte() % n; }

    std::uint64_t number() {
        const std::uint8_t first = byte();
        if (first < 0xC0) return first;
        if (first < 0xC0 + k_edges.size()) return k_edges[first - 0xC0u];
        std::uint64_t value = 0;
        for (int i = 0; i <= first % 8; ++i) value |= std::uint64_t{byte()} << 8 * i;
        return value;
    }
    std::string_view take(std::size_t size) {
        const std::string_view taken = rest_.substr(0, size);
        rest_.remove_prefix(taken.size());
        return taken;
    }
    /// Up to 255 bytes.
    std::string_view text() { return take(byte()); }

  private:
    std::string_view rest_;
};

}  // namespace pathscope::fuzz
