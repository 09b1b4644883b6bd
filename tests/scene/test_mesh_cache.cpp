#include <algorithm>
#include <bit>
#include <chrono>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/scene/load.hpp"
#include "pathscope/scene/mesh_cache.hpp"

#include "log_capture.hpp"
#include "memory_files.hpp"
#include "testing.hpp"

#include "scene/same_parts.hpp"

using namespace pathscope;
using namespace pathscope::testing;
namespace fs = std::filesystem;

namespace {

constexpr MeshCacheLimits k_any_size{.least_obj_bytes = 0};

/// All that a model can have: two materials, uvs, normals given and made, polygons, a triangle without area.
const std::string k_obj =
    "mtllib a.mtl\nmtllib missing one.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\n"
    "vt 0.1 0.7\nvn 0 0 1\nusemtl red\nf 1/1/1 2/1/1 3/1/1\nf 1 1 2\n"
    "usemtl old wood\ns 1\nf 1 2 3 4\nf 1 4 6 5\ns off\nf 2 3 4 6 5\n";
const std::string k_mtl = "newmtl red\nKd 1 0 0\nnewmtl old wood\nKd 0.5 0.25 0\n";

ObjModel model_of(const std::string& obj) {
    auto model = parse_obj(obj, "a.obj", true);
    REQUIRE(model);
    return std::move(*model);
}

void check_same(const ObjModel& a, const ObjModel& b) {
    testing::check_same(a.mesh, b.mesh);
    CHECK(a.material_names == b.material_names);
    CHECK(a.material_files == b.material_files);
    CHECK(a.degenerate_triangles == b.degenerate_triangles);
}

SceneParts load(const std::string& obj, const std::optional<MeshCache>& cache, bool smoothing = true) {
    MemoryFiles files{{"a.obj", obj}, {"a.mtl", k_mtl}};
    SceneFile scene;
    scene.objs = {"a.obj"};
    auto parts = load_scene_parts(scene, files, {.smoothing = smoothing}, cache);
    REQUIRE_MESSAGE(parts, (parts ? "" : parts.error().message));
    return std::move(*parts);
}

std::vector<fs::path> files_in(const fs::path& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    return files;
}

void write(const fs::path& path, std::string_view bytes) { REQUIRE(write_file_atomically(path, bytes)); }

}  // namespace

TEST_CASE("a mesh comes back from the cache as it was parsed") {
    const TemporaryFolder folder;
    const MeshCache cache(folder.path() / "deep" / "er", k_any_size);
    const Digest key = MeshCache::key_of(hash_text(k_obj), true);
    const ObjModel model = model_of(k_obj);
    REQUIRE(model.material_names == std::vector<std::string>{"red", "old wood"});
    REQUIRE(model.material_files == std::vector<std::string>{"a.mtl", "missing one.mtl"});
    REQUIRE(model.degenerate_triangles == 1);
    REQUIRE_FALSE(model.mesh.uvs.empty());
    REQUIRE_FALSE(model.mesh.normals.empty());

    CHECK_FALSE(cache.find(key));
    cache.store(key, model);
    const std::optional<ObjModel> found = cache.find(key);
    REQUIRE(found);
    check_same(*found, model);

    const ObjModel bare = model_of("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");  // No uvs, normals or names.
    cache.store(key, bare);
    check_same(cache.find(key).value(), bare);
}

TEST_CASE("a scene is the same without a cache, when the cache is filled, and from it") {
    const TemporaryFolder folder;
    const MeshCache cache(folder.path(), k_any_size);
    for (const bool smoothing : {true, false}) {
        const LogCapture quiet;
        const SceneParts parsed = load(k_obj, std::nullopt, smoothing);
        check_same(load(k_obj, cache, smoothing), parsed);
        check_same(load(k_obj, cache, smoothing), parsed);
    }
    CHECK(files_in(folder.path()).size() == 2);  // One with smoothing, one without.

    // It is the cache that answers: what lies there under the key is what comes.
    const ObjModel other = model_of("v 0 0 0\nv 7 0 0\nv 0 7 0\nf 1 2 3\n");
    cache.store(MeshCache::key_of(hash_text(k_obj), true), other);
    const LogCapture quiet;
    CHECK(load(k_obj, cache).mesh.positions == other.mesh.positions);
    CHECK(load(k_obj, cache, false).mesh.triangles.size() == 8);
}

TEST_CASE("files of a folder and of a manifest use one cached mesh") {
    const TemporaryFolder folder, cache_folder;
    const MeshCache cache(cache_folder.path(), k_any_size);
    write(folder.path() / "a.obj", k_obj);
    write(folder.path() / "a.mtl", k_mtl);
    SceneFile scene;
    scene.objs = {"a.obj"};
    DiskFiles disk(folder.path());
    const LogCapture quiet;
    const auto at_client = load_scene_parts(scene, disk, {}, cache);
    REQUIRE(at_client);

    std::map<Digest, fs::path> paths;
    for (const ManifestEntry& entry : disk.manifest().files) paths[entry.hash] = *disk.path_of(entry.name);
    ManifestFiles sent(disk.manifest(), [&](const Digest& hash) { return paths.at(hash); });
    const auto at_server = load_scene_parts(scene, sent, {}, cache);
    REQUIRE(at_server);
    check_same(*at_server, *at_client);
    CHECK(files_in(cache_folder.path()).size() == 1);
}

TEST_CASE("a damaged file of the cache is mentioned, replaced, and never changes what is loaded") {
    const TemporaryFolder folder;
    const MeshCache cache(folder.path(), k_any_size);
    std::optional<LogCapture> quiet(std::in_place);
    const SceneParts parsed = load(k_obj, cache);
    const fs::path path = cache.path_of(MeshCache::key_of(hash_text(k_obj), true));
    const std::string good = *read_file(path);
    quiet.reset();

    const auto check_refused = [&](const std::string& bad) {
        write(path, bad);
        LogCapture listener;
        check_same(load(k_obj, cache), parsed);
        const auto mentions = std::count_if(
            listener.said.begin(), listener.said.end(),
            [&](const std::string& sentence) { return sentence.find(path.string()) != std::string::npos; });
        CHECK(mentions == 1);
        CHECK(*read_file(path) == good);
    };
    REQUIRE(good.size() > 500);
    for (std::size_t i = 0; i < good.size(); i += i < 150 ? 1 : 7) {
        CAPTURE(i);
        std::string bad = good;
        bad[i] = char(bad[i] ^ (1 << i % 8));
        check_refused(bad);
    }
    for (const std::size_t size : {std::size_t{0}, std::size_t{31}, std::size_t{32}, std::size_t{33},
                                   good.size() / 2, good.size() - 1})
        check_refused(good.substr(0, size));
    check_refused(good + '\0');
    check_refused(k_obj);

    // Whole, but of another OBJ.
    const Digest other = MeshCache::key_of(hash_text("another"), true);
    cache.store(other, model_of("v 0 0 0\nv 7 0 0\nv 0 7 0\nf 1 2 3\n"));
    check_refused(*read_file(cache.path_of(other)));
}

TEST_CASE("a mesh that could not have been parsed is refused even if its seal is right") {
    const TemporaryFolder folder;
    const MeshCache cache(folder.path(), k_any_size);
    const Digest key = MeshCache::key_of(hash_text(k_obj), true);
    const auto refuses = [&](const std::function<void(ObjModel&)>& spoil) {
        ObjModel model = model_of(k_obj);
        spoil(model);
        cache.store(key, model);
        const LogCapture listener;
        return !cache.find(key) && listener.said.size() == 1;
    };
    CHECK_FALSE(refuses([](ObjModel&) {}));
    CHECK(refuses([](ObjModel& m) { m.mesh.materials.back() = 2; }));
    CHECK(refuses([](ObjModel& m) { m.mesh.materials.pop_back(); }));
    CHECK(refuses([](ObjModel& m) { m.mesh.materials.clear(); }));
    CHECK(refuses([](ObjModel& m) { m.material_names.clear(); }));
    CHECK(refuses([](ObjModel& m) { m.mesh.triangles[0].b = 1000; }));
    CHECK(refuses([](ObjModel& m) { m.mesh.positions[0].x = std::numeric_limits<float>::infinity(); }));
    CHECK(refuses([](ObjModel& m) { m.mesh.uvs.pop_back(); }));
}

TEST_CASE("counts in a file that promise more than it holds are refused before anything is allocated") {
    const TemporaryFolder folder;
    const MeshCache cache(folder.path(), k_any_size);
    const Digest key = MeshCache::key_of(hash_text(k_obj), true);
    const std::string_view key_text(reinterpret_cast<const char*>(key.data()), key.size());
    const auto find_sealed = [&](const std::string& payload) {
        const Digest seal = hash_text(std::string(key_text) + payload);
        write(cache.path_of(key), std::string(seal.begin(), seal.end()) + payload);
        const LogCapture quiet;
        return cache.find(key);
    };
    cache.store(key, model_of(k_obj));
    const std::string good = read_file(cache.path_of(key))->substr(key.size());
    REQUIRE(find_sealed(good));
    for (std::size_t word = 1; 8 * word + 8 <= good.size(); ++word) {
        std::string bad = good;
        bad.replace(8 * word, 8, 8, '\xff');  // A count, a length, NaNs, or indices out of range.
        const std::optional<ObjModel> found = find_sealed(bad);
        CAPTURE(word);
        CHECK((!found || found->material_names != model_of(k_obj).material_names ||
               found->material_files != model_of(k_obj).material_files));
    }
    for (std::size_t size = 0; size < good.size(); size += 3) CHECK_FALSE(find_sealed(good.substr(0, size)));
    CHECK_FALSE(find_sealed(good + "more"));
}

TEST_CASE("the key depends on the bytes and on smoothing") {
    const Digest a = hash_text("a"), b = hash_text("b");
    CHECK(MeshCache::key_of(a, true) == MeshCache::key_of(a, true));
    CHECK(MeshCache::key_of(a, true) != MeshCache::key_of(a, false));
    CHECK(MeshCache::key_of(a, true) != MeshCache::key_of(b, true));
}

TEST_CASE("small OBJ files are not cached, nor what is larger than the whole cache") {
    const TemporaryFolder folder;
    const LogCapture quiet;
    (void)load(k_obj, MeshCache(folder.path(), {.least_obj_bytes = k_obj.size() + 1}));
    (void)load(k_obj, MeshCache(folder.path(), {.most_bytes = 100, .least_obj_bytes = 0}));
    CHECK(files_in(folder.path()).empty());
    (void)load(k_obj, MeshCache(folder.path(), {.least_obj_bytes = k_obj.size()}));
    CHECK(files_in(folder.path()).size() == 1);
}

TEST_CASE("what was not used for the longest time goes first, and nothing that is not the cache's") {
    const TemporaryFolder folder;
    const ObjModel model = model_of(k_obj);
    const auto key = [](int i) { return MeshCache::key_of(hash_text(std::to_string(i)), true); };
    const MeshCache roomy(folder.path(), k_any_size);
    write(folder.path() / "photo.mesh", std::string(10'000, 'x'));
    for (int i = 0; i < 4; ++i) {
        roomy.store(key(i), model);
        fs::last_write_time(roomy.path_of(key(i)),
                            fs::file_time_type::clock::now() - std::chrono::hours(10 - i));
    }
    const fs::path left_over = roomy.path_of(key(9)).string() + ".part77-0";
    write(left_over, "begun and never renamed");
    fs::last_write_time(left_over, fs::file_time_type::clock::now() - std::chrono::hours(20));
    REQUIRE(roomy.find(key(0)));  // Used just now.

    const std::uint64_t size = fs::file_size(roomy.path_of(key(0)));
    const MeshCache tight(folder.path(), {.most_bytes = 3 * size, .least_obj_bytes = 0});
    tight.store(key(4), model);
    CHECK(tight.find(key(4)));
    CHECK(tight.find(key(0)));
    CHECK(tight.find(key(3)));
    CHECK_FALSE(tight.find(key(1)));
    CHECK_FALSE(tight.find(key(2)));
    CHECK_FALSE(fs::exists(left_over));
    CHECK(fs::exists(folder.path() / "photo.mesh"));
}

TEST_CASE("where the cache cannot be written to, loading goes on and says so") {
    const TemporaryFolder folder;
    write(folder.path() / "file", "in the way");
    LogCapture listener;
    const SceneParts parsed = load(k_obj, std::nullopt);
    listener.said.clear();
    check_same(load(k_obj, MeshCache(folder.path() / "file" / "folder", k_any_size)), parsed);
    CHECK(std::count_if(listener.said.begin(), listener.said.end(), [](const std::string& sentence) {
              return sentence.find("not cached") != std::string::npos;
          }) == 1);
}

/// When this fails, meshes of older programs would be taken for those of this one: raise k_mesh_cache_version,
/// then write down what the test prints.
TEST_CASE("the version of the cache is that of what is parsed and how it is written") {
    const TemporaryFolder folder;
    const MeshCache cache(folder.path(), k_any_size);
    const Digest key{};
    cache.store(key, model_of(k_obj));
    if constexpr (std::endian::native != std::endian::little) return;
    REQUIRE(k_mesh_cache_version == 1);
    CHECK(to_hex(hash_text(*read_file(cache.path_of(key)))) ==
          "9d3515195a000ca58ee866af345c6d05a76e66364ede65a645df28a653d2ec39");
}
