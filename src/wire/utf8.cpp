#include "pathscope/wire/utf8.hpp"

#include <cstdint>

namespace pathscope {
namespace {

struct Character {
    char32_t code = 0;
    std::size_t bytes = 0;  ///< 0 = the text does not begin with a well-formed character.
};

/// What a first byte says: how many bytes follow, and which code is the first that needs so many.
struct Lead {
    int following;
    char32_t bits, least;
};

Lead read_lead(std::uint8_t byte) {
    if (byte < 0x80) return {0, byte, 0};
    if (byte >= 0xC0 && byte < 0xE0) return {1, byte & 0x1Fu, 0x80};
    if (byte >= 0xE0 && byte < 0xF0) return {2, byte & 0x0Fu, 0x800};
    if (byte >= 0xF0 && byte < 0xF8) return {3, byte & 0x07u, 0x10000};
    return {-1, 0, 0};
}

Character first_character(std::string_view text) {
    const Lead lead = read_lead(static_cast<std::uint8_t>(text.front()));
    const std::size_t bytes = static_cast<std::size_t>(lead.following + 1);
    if (lead.following < 0 || text.size() < bytes) return {};
    char32_t code = lead.bits;
    for (std::size_t i = 1; i < bytes; ++i) {
        const auto byte = static_cast<std::uint8_t>(text[i]);
        if ((byte & 0xC0) != 0x80) return {};
        code = code << 6 | (byte & 0x3Fu);
    }
    const bool surrogate = code >= 0xD800 && code < 0xE000;
    if (code < lead.least || code > 0x10FFFF || surrogate) return {};
    return {code, bytes};
}

/// Most texts are nothing else, and then no character need be put together.
bool is_printable_ascii(std::string_view text) {
    bool printable = true;
    for (const char byte : text)
        printable &= byte >= ' ' && byte <= '~';  // Above 127 a char is negative, or large.
    return printable;
}

bool is_control(char32_t code) { return code < 0x20 || (code >= 0x7F && code < 0xA0); }

template <class Accept>
bool all_characters(std::string_view text, Accept accept) {
    while (!text.empty()) {
        const Character character = first_character(text);
        if (character.bytes == 0 || !accept(character.code)) return false;
        text.remove_prefix(character.bytes);
    }
    return true;
}

}  // namespace

bool is_utf8(std::string_view text) {
    return is_printable_ascii(text) || all_characters(text, [](char32_t) { return true; });
}

bool is_printable_utf8(std::string_view text) {
    return is_printable_ascii(text) || all_characters(text, [](char32_t code) { return !is_control(code); });
}

std::string make_printable(std::string_view text, std::size_t max_bytes) {
    std::string printable;
    while (!text.empty()) {
        const Character character = first_character(text);
        const bool keep = character.bytes > 0 && !is_control(character.code);
        const std::string_view piece = keep ? text.substr(0, character.bytes) : "?";
        if (printable.size() + piece.size() > max_bytes) break;
        printable += piece;
        text.remove_prefix(character.bytes > 0 ? character.bytes : 1);
    }
    return printable;
}

}  // namespace pathscope
