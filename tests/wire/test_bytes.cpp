#include "pathscope/wire/bytes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace std::string_literals;

TEST_CASE("numbers are laid out least or most significant byte first") {
    ByteWriter out;
    out.little(std::uint32_t{0x01020304});
    out.big(std::uint32_t{0x01020304});
    out.little(std::int16_t{-2});
    out.big(1.0);
    CHECK(out.bytes() == "\x04\x03\x02\x01\x01\x02\x03\x04\xFE\xFF\x3F\xF0\0\0\0\0\0\0"s);
}

TEST_CASE("what was written is read back, and not one byte more") {
    ByteWriter out;
    out.little(std::uint8_t{200});
    out.little(std::int64_t{-5});
    out.big(2.5f);
    out.raw("tail");
    const std::string bytes = out.take();

    ByteReader in(bytes);
    CHECK(in.little<std::uint8_t>() == 200);
    CHECK(in.little<std::int64_t>() == -5);
    CHECK(in.big<float>() == 2.5f);
    CHECK(in.raw(4) == "tail");
    CHECK(in.remaining() == 0);
    CHECK_FALSE(in.little<std::uint8_t>().has_value());
}

TEST_CASE("a read past the end is a miss and moves nothing") {
    ByteReader in("abc");
    CHECK_FALSE(in.little<std::uint32_t>().has_value());
    CHECK_FALSE(in.big<std::uint64_t>().has_value());
    CHECK_FALSE(in.raw(4).has_value());
    CHECK_FALSE(in.raw(std::size_t(-1)).has_value());
    CHECK(in.remaining() == 3);
    CHECK(in.raw(3) == "abc");
}
