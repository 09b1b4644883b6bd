#include <sys/stat.h>

#include <filesystem>

#include "pathscope/core/files.hpp"
#include "pathscope/scene/file_source.hpp"

#include "testing.hpp"

using namespace pathscope;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& path, std::string_view bytes) {
    fs::create_directories(path.parent_path());
    REQUIRE(write_file_atomically(path, bytes));
}

std::string text_of(FileSource& files, std::string_view name) {
    const auto bytes = files.find(name);
    REQUIRE(bytes);
    return bytes->value_or("(missing)");
}

}  // namespace

TEST_CASE("scene_name: from what stands in a file to a name relative to the scene") {
    struct Case {
        std::string referrer, name, result;
    };
    const Case cases[] = {
        {"", "a.obj", "a.obj"},
        {"a.obj", "a.mtl", "a.mtl"},
        {"models/a.obj", "a.mtl", "models/a.mtl"},
        {"models/a.mtl", "textures\\wood old.png", "models/textures/wood old.png"},
        {"models/a.mtl", "../textures/./b.png", "textures/b.png"},
        {"a.mtl", "../b.png", "../b.png"},
        {"a/b.mtl", "../../../c.png", "../../c.png"},
        {"models/a.mtl", "/usr/share/b.png", "/usr/share/b.png"},
        {"models/a.mtl", "C:\\maps\\b.png", "C:/maps/b.png"},
        {"a.mtl", "  wood.png \r", "wood.png"},
        {"a.mtl", "\"my wood.png\"", "my wood.png"},
        {"a.mtl", ".//wood.png", "wood.png"},
        {"a.mtl", "", ""},
    };
    for (const Case& c : cases) {
        CAPTURE(c.referrer);
        CAPTURE(c.name);
        CHECK(scene_name(c.referrer, c.name) == c.result);
    }
}

TEST_CASE("DiskFiles finds a file however its name is spelt") {
    const testing::TemporaryFolder folder;
    write(folder.path() / "Textures" / "Old Wood.JPG", "wood");
    write(folder.path() / "top.png", "top");
    write(folder.path() / "scene" / "scene.obj", "obj");
    DiskFiles files(folder.path() / "scene");
    DiskFiles root(folder.path());

    CHECK(text_of(root, "Textures/Old Wood.JPG") == "wood");
    CHECK(text_of(root, "textures/old wood.jpg") == "wood");
    CHECK(text_of(root, scene_name("", "TEXTURES\\OLD WOOD.jpg")) == "wood");
    CHECK(text_of(root, "scene/../TOP.png") == "top");
    CHECK(text_of(files, "../top.png") == "top");
    CHECK(text_of(root, (folder.path() / "top.png").string()) == "top");
    CHECK(text_of(root, "C:/somebody/else/TOP.PNG") == "top");
    CHECK(text_of(root, "/no/such/folder/top.png") == "top");

    CHECK(text_of(root, "Textures") == "(missing)");
    CHECK(text_of(root, "textures/other.png") == "(missing)");
    CHECK(text_of(root, "top.png/x") == "(missing)");
    CHECK(text_of(root, "") == "(missing)");
}

TEST_CASE("DiskFiles prefers the exact spelling, then the first in byte order") {
    const testing::TemporaryFolder folder;
    write(folder.path() / "a.png", "lower");
    write(folder.path() / "A.png", "upper");
    DiskFiles files(folder.path());
    CHECK(text_of(files, "a.png") == "lower");
    CHECK(text_of(files, "A.png") == "upper");
    CHECK(text_of(files, "a.PNG") == "upper");
}

TEST_CASE("DiskFiles opens no pipe: it would wait without end") {
    const testing::TemporaryFolder folder;
    REQUIRE(::mkfifo((folder.path() / "pipe.png").c_str(), 0600) == 0);
    DiskFiles files(folder.path());
    CHECK(text_of(files, "pipe.png") == "(missing)");
}

TEST_CASE("the manifest lists what was handed out and what was missing, sorted, and nothing else") {
    const testing::TemporaryFolder folder;
    write(folder.path() / "b.mtl", "mtl");
    write(folder.path() / "a.obj", "obj!");
    write(folder.path() / "secret.txt", "not asked for");
    DiskFiles files(folder.path());
    text_of(files, "B.mtl");
    text_of(files, "a.obj");
    text_of(files, "a.obj");
    text_of(files, "nowhere.png");

    const Manifest manifest = files.manifest();
    REQUIRE(manifest.files.size() == 2);
    CHECK(manifest.files[0].name == "B.mtl");
    CHECK(manifest.files[0].size == 3);
    CHECK(manifest.files[0].hash == hash_text("mtl"));
    CHECK(manifest.files[1].name == "a.obj");
    CHECK(manifest.missing == std::vector<std::string>{"nowhere.png"});

    CHECK(files.path_of("B.mtl") == folder.path() / "b.mtl");
    CHECK_FALSE(files.path_of("secret.txt"));
    CHECK_FALSE(files.path_of("nowhere.png"));
}

TEST_CASE("ManifestFiles gives the listed bytes, the listed misses, and refuses all else") {
    const testing::TemporaryFolder cache;
    const auto path_of_hash = [&](const Digest& hash) { return cache.path() / to_hex(hash); };
    write(path_of_hash(hash_text("mtl")), "mtl");
    write(path_of_hash(hash_text("obj")), "oBj");
    write(cache.path() / "plain.txt", "plain");
    ManifestFiles files({{{"a.mtl", 3, hash_text("mtl")},
                          {"/etc/a.obj", 3, hash_text("obj")},
                          {"gone.png", 4, hash_text("gone")},
                          {"short.png", 5, hash_text("mtl")}},
                         {"missing.png"}},
                        path_of_hash);

    CHECK(text_of(files, "a.mtl") == "mtl");
    CHECK(text_of(files, "missing.png") == "(missing)");
    const auto error_of = [&](std::string_view name) {
        const auto bytes = files.find(name);
        REQUIRE_FALSE(bytes);
        return bytes.error().message;
    };
    CHECK(error_of("A.mtl").find("A.mtl: the client did not list this file") == 0);
    CHECK(error_of("plain.txt").find("did not list") != std::string::npos);
    CHECK(error_of("/etc/a.obj").find("differs from what the client listed") != std::string::npos);
    CHECK(error_of("short.png").find("differs from what the client listed") != std::string::npos);
    CHECK(error_of("gone.png").find("gone.png: not in the cache") == 0);
}

TEST_CASE("a missing file that is needed is named as a path") {
    const testing::TemporaryFolder folder;
    DiskFiles files(folder.path());
    const auto bytes = files.read("models/a.obj");
    REQUIRE_FALSE(bytes);
    CHECK(bytes.error().message == (folder.path() / "models/a.obj").string() + ": there is no such file.");
}
