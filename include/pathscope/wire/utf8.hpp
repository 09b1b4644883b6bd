#pragma once
/// Text from outside: is it UTF-8 that can be shown to people as it stands?
///
/// Why: names and sentences of peers reach logs, terminals and the window. A control character there could
/// move the cursor or forge a line of a log.
/// Printable = well-formed UTF-8 (RFC 3629: shortest forms, no surrogates, at most U+10FFFF) without the
/// control characters U+0000..U+001F and U+007F..U+009F.
/// Thread safety: yes.   Test: tests/wire/test_utf8.cpp

#include <cstddef>
#include <string>
#include <string_view>

namespace pathscope {

[[nodiscard]] bool is_utf8(std::string_view text);
[[nodiscard]] bool is_printable_utf8(std::string_view text);

/// The text with every unprintable byte as '?', cut to at most max_bytes between two characters.
/// Ensures: is_printable_utf8 of the result.
[[nodiscard]] std::string make_printable(std::string_view text, std::size_t max_bytes);

}  // namespace pathscope
