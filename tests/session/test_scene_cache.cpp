#include "pathscope/session/scene_cache.hpp"

#include "pathscope/core/files.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("the cache holds files by content, and takes only what has the hash it claims") {
    const TemporaryFolder folder;
    const SceneCache cache(folder.path() / "deep" / "er");
    const Digest hash = hash_text("content");
    CHECK_FALSE(cache.holds(hash, 7));
    CHECK_FALSE(bool(cache.store(hash, "other")));
    REQUIRE(bool(cache.store(hash, "content")));
    CHECK(cache.holds(hash, 7));
    CHECK_FALSE(cache.holds(hash, 8));
    CHECK(*read_file(cache.path_of(hash)) == "content");
    cache.forget(hash);
    CHECK_FALSE(cache.holds(hash, 7));
}
