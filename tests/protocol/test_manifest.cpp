#include "pathscope/protocol/manifest.hpp"

#include "pathscope/math/random.hpp"
#include "pathscope/wire/message_pack.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

std::vector<ManifestEntry> some_files() {
    return {{"scene.json", 300, hash_text("a")},
            {"textures/wood.png", 0, hash_text("b")},
            {"box.obj", std::uint64_t{1} << 40, hash_text("c")}};
}

PackMap entry(PackValue name, PackValue size = 1, PackValue hash = PackBytes{std::string(32, 'h')}) {
    PackMap map;
    map.set("name", std::move(name));
    map.set("size", std::move(size));
    map.set("hash", std::move(hash));
    return map;
}

std::string refusal(const PackValue& value) {
    const auto files = unpack_manifest(pack(value));
    return files ? std::string() : files.error().message;
}

}  // namespace

TEST_CASE("a manifest comes back sorted, and equal lists are equal bytes") {
    const auto bytes = pack_manifest(some_files());
    REQUIRE(bool(bytes));
    const auto files = unpack_manifest(*bytes);
    REQUIRE(bool(files));
    REQUIRE(files->size() == 3);
    CHECK(files->at(0) == some_files()[2]);
    CHECK(files->at(1) == some_files()[0]);
    CHECK(files->at(2) == some_files()[1]);
    auto reversed = some_files();
    std::swap(reversed[0], reversed[2]);
    CHECK(*pack_manifest(reversed) == *bytes);
    CHECK(bool(unpack_manifest(*pack_manifest({}))));
}

TEST_CASE("only plain paths inside the scene's folder may travel") {
    for (const char* name : {"a", "a.obj", "textures/a b.png", "..a", "a..", "...", "caf\xC3\xA9/x"})
        CHECK_MESSAGE(is_plain_relative_path(name), name);
    for (const char* name : {"", "/", "/etc/passwd", "..", "../x", "a/../b", "a/..", ".", "./a", "a//b", "a/",
                             "C:\\x", "C:x", "a\\b", "a\nb", "\xFF"}) {
        CHECK_FALSE_MESSAGE(is_plain_relative_path(name), name);
        CHECK_FALSE(bool(pack_manifest({{name, 1, {}}})));
        CHECK_FALSE(refusal(PackArray{entry(PackBytes{name})}).empty());
    }
    CHECK_FALSE(is_plain_relative_path(std::string(513, 'x')));
    CHECK(refusal(PackArray{entry("../x")}).find("'../x' is no plain path") != std::string::npos);
}

TEST_CASE("lists that are not ours are refused with a sentence") {
    CHECK(refusal(PackArray{entry("a"), entry("b")}).empty());
    CHECK(refusal(PackArray{entry("a"), entry("a")}).find("listed twice") != std::string::npos);
    CHECK(refusal(PackArray{entry("b"), entry("a")}).find("out of order") != std::string::npos);
    CHECK(refusal(PackMap{}).find("not an array") != std::string::npos);
    CHECK(refusal(PackArray{7}).find("not a map") != std::string::npos);
    CHECK(refusal(PackArray{entry("a", -1)}).find("'size'") != std::string::npos);
    CHECK(refusal(PackArray{entry("a", (std::uint64_t{1} << 40) + 1)}).find("'size'") != std::string::npos);
    CHECK(refusal(PackArray{entry("a", 1, PackBytes{"short"})}).find("'hash'") != std::string::npos);
    PackMap extra = entry("a");
    extra.set("mode", 0755);
    CHECK(refusal(PackArray{extra}).find("'mode' is not known") != std::string::npos);
    CHECK_FALSE(bool(unpack_manifest("")));
}

TEST_CASE("a full manifest fits, one more file does not") {
    std::vector<ManifestEntry> files(k_max_manifest_files);
    for (std::size_t i = 0; i < files.size(); ++i) files[i].name = std::to_string(i);
    const auto bytes = pack_manifest(files);
    REQUIRE(bool(bytes));
    CHECK(unpack_manifest(*bytes)->size() == k_max_manifest_files);
    files.push_back({"one more", 0, {}});
    CHECK_FALSE(bool(pack_manifest(files)));
}

TEST_CASE("mutated manifests never crash") {
    HashRng rng(7);
    const std::string bytes = *pack_manifest(some_files());
    for (int i = 0; i < 20'000; ++i) {
        std::string mutant = bytes;
        mutant[rng.next_u32() % mutant.size()] = static_cast<char>(rng.next_u32());
        if (const auto files = unpack_manifest(mutant))
            for (const ManifestEntry& file : *files) REQUIRE(is_plain_relative_path(file.name));
    }
}
