#include "pathscope/session/scene_fetch.hpp"

#include "pathscope/core/files.hpp"
#include "pathscope/session/render_state.hpp"
#include "pathscope/session/scene_depot.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// A scene folder of three files, read through DiskFiles as the loader does; one name is missing.
struct ClientFiles {
    TemporaryFolder folder;
    DiskFiles disk{folder.path()};

    ClientFiles() {
        REQUIRE(bool(write_file_atomically(folder.path() / "a.obj", std::string(700'000, 'a') + "end")));
        REQUIRE(bool(write_file_atomically(folder.path() / "empty.mtl", "")));
        REQUIRE(bool(write_file_atomically(folder.path() / "t.png", "texture")));
        for (const char* name : {"a.obj", "empty.mtl", "t.png", "none.png"}) REQUIRE(bool(disk.find(name)));
    }
};

/// Carries requests to the depot and answers back until nothing more is asked. Returns how many pieces went.
int exchange(SceneFetch& fetch, const SceneDepot& depot, TimeNs now) {
    int pieces = 0;
    for (std::vector<Message> asked = fetch.requests(now); !asked.empty(); asked = fetch.requests(now))
        for (const Message& message : asked) {
            if (const auto* request = std::get_if<message::ManifestRequest>(&message))
                CHECK(bool(fetch.on_manifest(*depot.answer(*request))));
            if (const auto* request = std::get_if<message::PieceRequest>(&message)) {
                ++pieces;
                CHECK(bool(fetch.on_piece(*depot.answer(*request))));
            }
        }
    return pieces;
}

}  // namespace

TEST_CASE("a server gets the files that it lacks, by content, and loads the same bytes and the same misses") {
    ClientFiles client;
    const SceneDepot depot(client.disk);
    const TemporaryFolder cache_folder;
    const SceneCache cache(cache_folder.path());
    SceneFetch fetch(cache, depot.manifest_hash());
    CHECK(exchange(fetch, depot, 0) == 3 + 1);  // 700,003 bytes in pieces of 256 KiB, and the texture.
    REQUIRE(fetch.complete());
    ManifestFiles files(fetch.manifest(), [&](const Digest& hash) { return cache.path_of(hash); });
    CHECK((*files.read("a.obj")).size() == 700'003);
    CHECK(*files.read("t.png") == "texture");
    CHECK(*files.read("empty.mtl") == "");
    CHECK_FALSE((*files.find("none.png")).has_value());

    SceneFetch again(cache, depot.manifest_hash());
    CHECK(exchange(again, depot, 0) == 0);  // All of it is in the cache.
    CHECK(again.complete());
}

TEST_CASE("requests without an answer are repeated, answers out of order are put in order, doubles ignored") {
    ClientFiles client;
    const SceneDepot depot(client.disk);
    const TemporaryFolder cache_folder;
    SceneFetch fetch(SceneCache(cache_folder.path()), depot.manifest_hash());
    REQUIRE(fetch.requests(0).size() == 1);
    CHECK(fetch.requests(1).empty());
    CHECK(fetch.requests(SceneFetch::k_patience).size() == 1);
    REQUIRE(bool(fetch.on_manifest(*depot.answer(message::ManifestRequest{depot.manifest_hash()}))));

    std::vector<Message> asked = fetch.requests(10);
    REQUIRE(asked.size() == 3);
    CHECK(fetch.requests(11).empty());
    CHECK(fetch.requests(10 + SceneFetch::k_patience).size() == 3);
    for (int i : {2, 0, 0, 1})
        CHECK(bool(fetch.on_piece(*depot.answer(std::get<message::PieceRequest>(asked[std::size_t(i)])))));
    CHECK_FALSE(fetch.complete());
    exchange(fetch, depot, 20);
    CHECK(fetch.complete());
}

TEST_CASE("what was altered on the way is refused and fetched again") {
    ClientFiles client;
    const SceneDepot depot(client.disk);
    const TemporaryFolder cache_folder;
    SceneFetch fetch(SceneCache(cache_folder.path()), depot.manifest_hash());
    message::Manifest forged = *depot.answer(message::ManifestRequest{depot.manifest_hash()});
    forged.files.back() ^= 1;
    (void)fetch.requests(0);
    CHECK_FALSE(bool(fetch.on_manifest(forged)));
    REQUIRE(bool(fetch.on_manifest(*depot.answer(message::ManifestRequest{depot.manifest_hash()}))));

    const std::vector<Message> asked = fetch.requests(1);
    for (std::size_t i = 0; i < asked.size(); ++i) {
        message::Piece piece = *depot.answer(std::get<message::PieceRequest>(asked[i]));
        if (i == 0) piece.bytes[5] ^= 1;
        CHECK(bool(fetch.on_piece(std::move(piece))) == (i + 1 < asked.size()));  // The whole shows it.
    }
    exchange(fetch, depot, 2);
    CHECK(fetch.complete());
}

TEST_CASE("the depot gives out what the manifest lists, and nothing else") {
    ClientFiles client;
    const SceneDepot depot(client.disk);
    CHECK_FALSE(depot.answer(message::ManifestRequest{hash_text("other")}).has_value());
    CHECK_FALSE(depot.answer(message::PieceRequest{hash_text("other"), 0, 10}).has_value());
    const Digest texture = hash_text("texture");
    CHECK(depot.answer(message::PieceRequest{texture, 3, 100})->bytes == "ture");
    CHECK_FALSE(depot.answer(message::PieceRequest{texture, 7, 1}).has_value());
}
