#include <filesystem>
#include <string>
#include <vector>

#include "pathscope/scene/load.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

#include "scene/loading.hpp"
#include "scene/same_parts.hpp"

using namespace pathscope;
using namespace pathscope::testing;
namespace fs = std::filesystem;

TEST_CASE("a scene loads into the same bits from a folder and from a manifest") {
    const testing::TemporaryFolder folder, cache;
    write(folder.path() / "room.obj",
          "mtllib Room Parts.MTL\n" + triangle("vt 0.1 0.2\nusemtl m\ns 1\n") + "f 1/1 2/1 3/1\n");
    write(folder.path() / "room parts.mtl",
          "newmtl m\nKd 0.3 0.3 0.3\nmap_Kd Maps\\RED.tga\nmap_Ks none.png\nKe 1 2 3\n");
    write(folder.path() / "maps" / "red.TGA", tga({1, 2, 200, 50}));
    write(folder.path() / "unrelated.txt", "private");
    const LogCapture quiet;
    const auto opened = open_scene(folder.path() / "room.obj", {});
    REQUIRE(opened);

    const Manifest manifest = opened->files->manifest();
    CHECK(manifest.files.size() == 3);
    CHECK(manifest.missing == std::vector<std::string>{"none.png"});
    for (const ManifestEntry& entry : manifest.files)
        fs::copy_file(*opened->files->path_of(entry.name), cache.path() / to_hex(entry.hash));
    ManifestFiles sent(manifest, [&](const Digest& hash) { return cache.path() / to_hex(hash); });
    const auto scene = parse_scene_file(to_json(opened->file), "state");
    REQUIRE(scene);
    testing::check_same(parts_of(*scene, sent), opened->parts);

    // Other options need other files: that is an error on the server, not a silent difference.
    ManifestFiles other({}, [&](const Digest&) { return cache.path(); });
    CHECK(error_of(*scene, other).find("room.obj: the client did not list this file") != std::string::npos);
}
