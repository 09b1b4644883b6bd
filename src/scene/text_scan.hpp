#pragma once
/// Reading OBJ and MTL text: lines, words and numbers, as both formats have them.
///
/// A line ends with LF, CRLF or CR. Words are separated by spaces and tabs. A number is a decimal, perhaps with
/// sign, point and exponent; "nan" and "inf" are read as what they say, so that the caller can refuse them.
/// Thread safety: values.

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

namespace pathscope {

[[nodiscard]] inline bool is_blank(char c) { return c == ' ' || c == '\t'; }
[[nodiscard]] inline bool ends_line(char c) { return c == '\n' || c == '\r'; }

/// Takes the next line off the text, without what ends it.
[[nodiscard]] inline std::string_view take_line(std::string_view& text) {
    std::size_t length = 0;
    while (length < text.size() && !ends_line(text[length])) ++length;
    const std::string_view line = text.substr(0, length);
    if (text.substr(length, 2) == "\r\n") ++length;
    text.remove_prefix(length < text.size() ? length + 1 : length);
    return line;
}

/// Takes the next word off the line; empty at its end.
[[nodiscard]] inline std::string_view take_word(std::string_view& line) {
    std::size_t first = 0;
    while (first < line.size() && is_blank(line[first])) ++first;
    std::size_t last = first;
    while (last < line.size() && !is_blank(line[last])) ++last;
    const std::string_view word = line.substr(first, last - first);
    line.remove_prefix(last);
    return word;
}

/// What is left of a line, without the blanks around it.
[[nodiscard]] inline std::string_view rest_of(std::string_view line) {
    while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return line;
}

/// The whole word as a number, or nothing. Beyond the range of double it is infinity or zero.
[[nodiscard]] inline std::optional<double> number_of(std::string_view word) {
    if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size() || error == std::errc::invalid_argument) return std::nullopt;
    if (error == std::errc::result_out_of_range) return std::strtod(std::string(word).c_str(), nullptr);
    return value;
}

}  // namespace pathscope
