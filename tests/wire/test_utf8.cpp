#include "pathscope/wire/utf8.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("UTF-8 is recognised by RFC 3629") {
    for (const char* text : {"", "plain", "\xC3\xA9", "\xE2\x82\xAC", "\xF0\x9F\x98\x80", "\xF4\x8F\xBF\xBF"})
        CHECK(is_utf8(text));
    CHECK_FALSE(is_utf8("\x80"));              // A following byte alone.
    CHECK_FALSE(is_utf8("\xC3"));              // Cut.
    CHECK_FALSE(is_utf8("\xC3("));             // Not a following byte.
    CHECK_FALSE(is_utf8("\xC0\xAF"));          // '/' in two bytes: longer than needed.
    CHECK_FALSE(is_utf8("\xE0\x80\xAF"));      // '/' in three.
    CHECK_FALSE(is_utf8("\xED\xA0\x80"));      // A surrogate.
    CHECK_FALSE(is_utf8("\xF4\x90\x80\x80"));  // Above U+10FFFF.
    CHECK_FALSE(is_utf8("\xF8\x88\x80\x80\x80"));
}

TEST_CASE("control characters are not printable") {
    CHECK(is_printable_utf8("Zo\xC3\xAB, node 7"));
    for (const char* text : {"a\nb", "a\x1B[2J", "\x7F", "\xC2\x9B"}) {
        CHECK(is_utf8(text));
        CHECK_FALSE(is_printable_utf8(text));
    }
}

TEST_CASE("make_printable replaces what cannot be shown and cuts between characters") {
    CHECK(make_printable("a\nb\xFF", 100) == "a?b?");
    CHECK(make_printable("caf\xC3\xA9", 5) == "caf\xC3\xA9");
    CHECK(make_printable("caf\xC3\xA9", 4) == "caf");
    CHECK(make_printable("\xC2\x9B", 9) == "?");
    CHECK(make_printable("abc", 0).empty());
}
