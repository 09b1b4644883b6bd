#include "pathscope/session/render_state.hpp"

#include <fstream>
#include <sstream>

#include "pathscope/core/files.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

RenderState some_state() {
    RenderState state;
    state.scene.name = "box";
    state.scene.objs = {"box.obj"};
    state.scene.cameras = {{"front", {}, std::nullopt}};
    state.scene.lights = {SkySpec{{0.1f, 0.2f, 0.3f}}, SunSpec{}};
    state.files = hash_text("files");
    state.camera = {{0.1f, 1e5f, -3}, {0, 0, 0}, {0, 0, 1}, 33.3f};
    state.settings.width = 123;
    state.settings.seed = 0xffffffffu;
    state.settings.transport = make_settings(Setting::textbook);
    state.settings.transport.max_bounces = 7;
    state.settings.filter = FilterPlace::server;
    state.settings.filter_kind = FilterKind::atrous;
    state.settings.bilateral.sigma_albedo = k_infinity;
    state.settings.atrous.levels = 3;
    state.settings.atrous.sigma_depth = 0.25f;
    state.settings.quantum = {-27};
    return state;
}

/// The map with one entry replaced.
Result<RenderState> decode_with(std::string_view key, PackValue value) {
    PackMap map = encode_state(some_state());
    map.set(key, std::move(value));
    return decode_state(map);
}

}  // namespace

TEST_CASE("a state comes back from the wire to the last bit, with an equal hash") {
    const RenderState state = some_state();
    const Result<PackValue> value = unpack(pack(encode_state(state)), k_payload_limits);
    REQUIRE(bool(value));
    const Result<RenderState> back = decode_state(*value->get<PackMap>());
    REQUIRE_MESSAGE(bool(back), back.error().message);
    CHECK(*back == state);
    CHECK(state_hash(*back) == state_hash(state));
}

TEST_CASE("changes hold what differs, and lead from one state to the other") {
    const RenderState before = some_state();
    RenderState after = before;
    after.camera.position.x = 2;
    after.settings.spp = 99;
    const PackMap changes = state_changes(before, after);
    CHECK(changes.size() == 2);
    CHECK(*apply_changes(before, changes) == after);
    CHECK(state_hash(after) != state_hash(before));
    CHECK(same_scene(before, after));
    after.scene.lights.pop_back();
    CHECK_FALSE(same_scene(before, after));
}

TEST_CASE("what does not fit is refused in a sentence that names the key") {
    const std::pair<std::string, PackValue> wrong[] = {
        {"size", PackArray{0, 10}},
        {"size", PackArray{10}},
        {"size", "10x10"},
        {"spp", -1},
        {"spp", std::uint64_t{1} << 40},
        {"seed", 1.5},
        {"light", "none"},
        {"material", true},
        {"quantum", 1000},
        {"camera", PackMap{}},
        {"scene", "{}"},
        {"scene", "{\"name\": 1"},
        {"files", PackBytes{"short"}},
        {"roulette", "constant"},
        {"filter", PackMap{}},
        {"colour", 1},
    };
    for (const auto& [key, value] : wrong) {
        CAPTURE(key);
        const Result<RenderState> state = decode_with(key, value);
        REQUIRE_FALSE(bool(state));
        CHECK(state.error().message.find("'" + key + "'") != std::string::npos);
    }
}

TEST_CASE("a filter that is not possible is refused in a sentence that names what is wrong with it") {
    const PackMap good = *encode_state(some_state()).find("filter")->get<PackMap>();
    const auto refusal = [&](std::string_view kind, std::string_view key, PackValue value) {
        PackMap filter = good, params = *good.find(kind)->get<PackMap>();
        params.set(key, std::move(value));
        filter.set(kind, std::move(params));
        const Result<RenderState> state = decode_with("filter", std::move(filter));
        return state ? std::string() : state.error().message;
    };
    CHECK(refusal("joint", "radius", 7).empty());
    CHECK(refusal("joint", "radius", 65).find("'radius'") != std::string::npos);
    CHECK(refusal("atrous", "levels", 7).find("'levels'") != std::string::npos);
    CHECK(refusal("atrous", "sigma_colour", 1e-6).find("sigma_colour") != std::string::npos);
    CHECK(refusal("joint", "sigma_depth", -1).find("'sigma_depth'") != std::string::npos);
    PackMap unknown = good;
    unknown.set("width", 3);
    CHECK_FALSE(bool(decode_with("filter", std::move(unknown))));
}

TEST_CASE("docs/protocol.md lists the keys of the state, in their order") {
    std::istringstream document(*read_file("docs/protocol.md"));
    std::vector<std::string> listed;
    bool in_section = false;
    for (std::string line; std::getline(document, line);) {
        if (line.rfind("## ", 0) == 0) in_section = line == "## 10 Render state";
        if (in_section && line.rfind("| ", 0) == 0) listed.push_back(line.substr(2, line.find(" |", 2) - 2));
    }
    REQUIRE(listed.size() > 1);
    listed.erase(listed.begin());  // The head of the table.
    std::vector<std::string> encoded;
    const PackMap map = encode_state(some_state());
    for (const auto& [key, value] : map.entries()) encoded.push_back(key);
    CHECK(listed == encoded);
}

TEST_CASE("a manifest comes back from the wire; a damaged one is a sentence") {
    const Manifest manifest{{{"a b.obj", 17, hash_text("a")}, {"tex\xff/\x01.png", 0, hash_text("b")}},
                            {"missing.png"}};
    const std::string bytes = pack_manifest(manifest);
    CHECK(*unpack_manifest(bytes) == manifest);
    for (std::size_t size = 0; size < bytes.size(); ++size)
        CHECK_FALSE(bool(unpack_manifest(bytes.substr(0, size))));
    Manifest huge = manifest;
    huge.files[0].size = huge.files[1].size = k_max_scene_bytes;
    CHECK(unpack_manifest(pack_manifest(huge)).error().message.find("are allowed") != std::string::npos);
}
