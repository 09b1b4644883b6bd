#include <filesystem>
#include <set>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/core/result.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {
enum class Fruit { apple, pear };
constexpr std::array k_fruit_names{EnumName<Fruit>{Fruit::apple, "apple"},
                                   EnumName<Fruit>{Fruit::pear, "pear"}};
constexpr const auto& enum_table(Fruit) { return k_fruit_names; }
}  // namespace

TEST_CASE("a Result holds a value or a sentence") {
    const Result<int> value = 7;
    REQUIRE(bool(value));
    CHECK(*value == 7);
    const Result<int> error = bad_input("No such thing.");
    REQUIRE_FALSE(bool(error));
    CHECK(error.error().message == "No such thing.");
    CHECK(error.error().kind == ErrorKind::bad_input);
    CHECK(bool(Result<void>{}));
    CHECK(Result<void>{failed("Broken.")}.error().kind == ErrorKind::failed);
}

TEST_CASE("enum names go both ways") {
    CHECK(name_of(Fruit::pear) == "pear");
    CHECK(from_name<Fruit>("apple") == Fruit::apple);
    CHECK_FALSE(from_name<Fruit>("plum").has_value());
    CHECK(joined_names<Fruit>() == "apple|pear");
}

TEST_CASE("hash_text is BLAKE2b-256") {
    // RFC 7693 gives BLAKE2b-512 of "abc"; this is the 256-bit one, from the BLAKE2 reference program.
    const std::string abc = "bddd813c634239723171ef3fee98579b94964e3bb1cb3e427262c8c068d52319";
    CHECK(to_hex(hash_text("abc")) == abc);
    Hasher parts;
    parts.add("a");
    parts.add("bc");
    CHECK(to_hex(parts.finish()) == abc);
    // More than one block of 128 bytes, in parts that end within, at and beyond its end.
    const std::string text(1000, 'x');
    for (const std::size_t cut : {0u, 1u, 127u, 128u, 129u, 1000u}) {
        Hasher two;
        two.add(text.substr(0, cut));
        two.add(text.substr(cut));
        CHECK(two.finish() == hash_text(text));
    }
    CHECK(digest_from_hex(abc) == hash_text("abc"));
    CHECK_FALSE(digest_from_hex("xyz").has_value());
    CHECK_FALSE(digest_from_hex(abc.substr(1) + "g").has_value());
}

TEST_CASE("files are written whole and read whole, errors name the path") {
    const testing::TemporaryFolder temporary;
    const std::filesystem::path& folder = temporary.path();
    const auto path = folder / "a file.txt";
    REQUIRE(bool(write_file_atomically(path, "first")));
    REQUIRE(bool(write_file_atomically(path, "second")));
    CHECK(*read_file(path) == "second");
    CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 1);

    CHECK(read_file(folder).error().message.find("is a folder") != std::string::npos);
    CHECK(read_file(folder / "none").error().message.find("none: No such file") != std::string::npos);
    CHECK_FALSE(bool(write_file_atomically(folder / "no" / "x", "")));
}

TEST_CASE("a place for a file is tried without a trace, and what killed programs left is found by its name") {
    const testing::TemporaryFolder temporary;
    const std::filesystem::path& folder = temporary.path();
    const auto path = folder / "f";
    CHECK(bool(check_place(path)));
    CHECK(std::filesystem::is_empty(folder));
    REQUIRE(bool(write_file_atomically(path, "kept")));
    CHECK(bool(check_place(path)));
    CHECK(*read_file(path) == "kept");
    CHECK(check_place(folder).error().message.find("is a folder") != std::string::npos);
    CHECK(check_place(folder / "no" / "f").error().message.find("make it first") != std::string::npos);

    for (const char* name : {"f.part7-0", "f.part123-45", "f.part7", "f.part-1", "f.part7-x", "g.part7-0"})
        REQUIRE(bool(write_file_atomically(folder / name, "")));
    remove_abandoned_parts(path);
    CHECK(!std::filesystem::exists(folder / "f.part7-0"));
    CHECK(!std::filesystem::exists(folder / "f.part123-45"));
    CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 5);
    remove_abandoned_parts(folder / "no" / "f");
}

TEST_CASE("a log sink receives what stderr would") {
    std::string seen;
    const LogSink before = set_log_sink([&](LogLevel level, std::string_view text) {
        seen += level == LogLevel::warning ? "W:" : "N:";
        seen += text;
    });
    log_note("a");
    log_warning("b");
    set_log_sink(before);
    CHECK(seen == "N:aW:b");
}
