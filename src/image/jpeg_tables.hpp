#pragma once
/// Asks a .jpg for Huffman tables that its decoder would write beyond: stb_image up to 2.27 takes the sixteen counts of a table
/// at their word, though a table holds at most 256 codes.
///
///     table = class-and-number count[16] code[sum of counts]      ; after FF C4 and a length of two bytes
///
/// Why a walk and then a search: up to the first scan one segment follows the other, and what is inside a segment of metadata
/// may look like anything. Behind that the decoder looks for the next marker wherever it lost its way, so every FF C4 counts.
/// Source: ITU-T T.81, B.2.4.2. Thread safety: yes.   Test: tests/image/test_io.cpp

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace pathscope {

namespace detail {

/// Requires: `segment` begins with the length of a segment of tables.
[[nodiscard]] inline bool tables_fit(std::string_view segment) {
    const auto at = [&](std::size_t i) {
        return i < segment.size() ? std::size_t(std::uint8_t(segment[i])) : 0;
    };
    const std::size_t end = 256 * at(0) + at(1);
    for (std::size_t table = 2; table < end && table < segment.size();) {
        if (at(table) / 16 > 1 || at(table) % 16 > 3) return true;  // No table: the decoder stops.
        std::size_t codes = 0;
        for (std::size_t i = 1; i <= 16; ++i) codes += at(table + i);
        if (codes > 256) return false;
        table += 17 + codes;
    }
    return true;
}

}  // namespace detail

/// Requires: a file that begins as a .jpg does.
[[nodiscard]] inline bool huffman_tables_fit(std::string_view file) {
    constexpr std::string_view k_tables = "\xff\xc4", k_scan = "\xff\xda";
    std::size_t place = 2;
    while (place + 4 <= file.size() && file[place] == '\xff' && file[place + 1] != '\xff') {
        const std::string_view marker = file.substr(place, 2);
        if (marker == k_scan) break;
        if (marker == k_tables && !detail::tables_fit(file.substr(place + 2))) return false;
        const std::size_t length =
            std::size_t(std::uint8_t(file[place + 2])) * 256 + std::uint8_t(file[place + 3]);
        if (length < 2) break;
        place += 2 + length;
    }
    for (; (place = file.find(k_tables, place)) != file.npos; ++place)
        if (!detail::tables_fit(file.substr(place + 2))) return false;
    return true;
}

}  // namespace pathscope
