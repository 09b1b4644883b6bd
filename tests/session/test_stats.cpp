#include "pathscope/session/stats.hpp"

#include <nlohmann/json.hpp>

#include "testing.hpp"

using namespace pathscope;
using Json = nlohmann::json;

namespace {

RenderState small_state() {
    RenderState state;
    state.scene.name = "a \"small\" room";
    state.settings.width = 70;
    state.settings.height = 40;
    state.settings.spp = 8;
    state.settings.direct_spp = 2;
    state.settings.seed = 7;
    return state;
}

}  // namespace

TEST_CASE("the statistics hold every key that scripts read, before anything has happened") {
    const Json json = Json::parse(stats_json(small_state(), EventStore(), {}));
    for (const char* key : {"version",
                            "scene",
                            "width",
                            "height",
                            "spp",
                            "seed",
                            "wall_s",
                            "load_s",
                            "build_s",
                            "render_s",
                            "triangles",
                            "mesh_bytes_per_triangle",
                            "bvh_bytes_per_triangle",
                            "rays",
                            "rays_per_s",
                            "samples",
                            "samples_per_s",
                            "image_hash",
                            "reproducible",
                            "differing_rounds",
                            "stuck",
                            "estimated_error",
                            "samples_per_pixel_min",
                            "samples_per_pixel_mean",
                            "samples_per_pixel_max",
                            "servers",
                            "rounds",
                            "rounds_committed",
                            "duplicates_dropped",
                            "stale_dropped",
                            "bad_messages",
                            "leases_expired",
                            "reallocated",
                            "tile_bytes",
                            "tile_bytes_unpacked",
                            "bytes_in",
                            "bytes_out",
                            "nonfinite_dropped",
                            "threads"})
        CHECK_MESSAGE(json.contains(key), key);
    CHECK(json["scene"] == "a \"small\" room");
    CHECK(json["width"] == 70);
    CHECK(json["height"] == 40);
    CHECK(json["spp"] == 8);
    CHECK(json["seed"] == 7);
    CHECK(json["wire"] == "exact");
    CHECK(json["reproducible"] == true);
    CHECK(json["servers"] == Json::array());
    CHECK(json["estimated_error"].is_null());
    CHECK(json["rays_per_s"] == 0);  // And not a division by no time, which JSON cannot say.
}

TEST_CASE("a run that went on says from what, and its figures are those of both") {
    EventStore store;
    store.count(Counter::samples, 60, ServerId{1});
    store.count(Counter::samples, 10);
    store.count_earlier({{Counter::samples, 30}});
    RunFigures figures;
    figures.render_s = 20;
    CHECK(Json::parse(stats_json(small_state(), store, figures))["resumed"].is_null());
    figures.resumed = WorkHistory{2, 12, 5, 6, 7, 30, 0, 0, {}};
    const Json json = Json::parse(stats_json(small_state(), store, figures));
    CHECK(json["resumed"] ==
          Json{{"runs", 2}, {"rounds", 5}, {"samples", 30}, {"rays", 7}, {"render_s", 12.0}});
    CHECK(json["samples"] == 100);
    CHECK(json["samples_per_s"] == 5);
    CHECK(json["client"]["samples"] == 10);
    CHECK(json["servers"][0]["samples"] == 60);
}

TEST_CASE("the numbers are those of the store, each counter under its own key") {
    EventStore store;
    for (std::size_t i = 0; i < k_counters; ++i)
        store.count(k_counter_names[i].value, 100 + i, i % 2 == 0 ? k_local_server : ServerId{1});
    RunFigures figures;
    figures.wall_s = 9.5;
    figures.load_s = 1.5;
    figures.build_s = 2.5;
    figures.render_s = 4;
    figures.threads = 3;
    figures.memory = {10, 450, 720};
    figures.image_hash = hash_text("image");
    figures.saturated = 5;
    figures.estimated_error = 0.125;
    Plane samples(2, 2, 4.0f);
    samples.at(1, 0) = 2;
    samples.at(0, 1) = 10;
    figures.samples_per_pixel = summary_of(samples);
    figures.dropped = {{3, 4, 17}};
    const Json json = Json::parse(stats_json(small_state(), store, figures));

    for (std::size_t i = 0; i < k_counters; ++i) {
        const std::string name(k_counter_names[i].name);
        CHECK_MESSAGE(json.at(name) == 100 + i, name);
    }
    CHECK(json["wall_s"] == 9.5);
    CHECK(json["load_s"] == 1.5);
    CHECK(json["build_s"] == 2.5);
    CHECK(json["render_s"] == 4);
    CHECK(json["threads"] == 3);
    CHECK(json["strategy"] == "blocks");
    CHECK(json["triangles"] == 10);
    CHECK(json["mesh_bytes_per_triangle"] == 45);
    CHECK(json["bvh_bytes_per_triangle"] == 72);
    CHECK(json["rays_per_s"] == double(store.total(Counter::rays)) / 4);
    CHECK(json["samples_per_s"] == double(store.total(Counter::samples)) / 4);
    CHECK(json["image_hash"] == to_hex(figures.image_hash));
    CHECK(json["estimated_error"] == 0.125);
    CHECK(json["samples_per_pixel_min"] == 2);
    CHECK(json["samples_per_pixel_mean"] == 5);
    CHECK(json["samples_per_pixel_max"] == 10);
    CHECK(json["saturated"] == 5);
    CHECK(json["dropped_samples"] == Json::parse(R"([{"x": 3, "y": 4, "sample": 17}])"));
}

TEST_CASE("each server has its own figures; the client is not one of them") {
    EventStore store;
    store.count(Counter::samples, 1000);
    store.name_server(ServerId{1}, "anna");
    store.name_server(ServerId{2}, "bert");
    store.count_all({{Counter::samples, 64}, {Counter::tiles, 2}, {Counter::bytes_in, 4096}}, ServerId{2});
    store.count(Counter::died, 1, ServerId{2});
    for (int i = 1; i <= 100; ++i) store.add_latency(Latency::heartbeat, i * k_millisecond_ns, ServerId{2});
    const Json json = Json::parse(stats_json(small_state(), store, {}));

    REQUIRE(json["servers"].size() == 2);
    const Json anna = json["servers"][0], bert = json["servers"][1];
    CHECK(anna.at("name") == "anna");
    CHECK(anna.at("samples") == 0);
    CHECK(anna.at("died") == false);
    CHECK(bert.at("name") == "bert");
    CHECK(bert.at("samples") == 64);
    CHECK(bert.at("tiles") == 2);
    CHECK(bert.at("bytes") == 4096);
    CHECK(bert.at("died") == true);
    const LatencySummary rtt = store.server(ServerId{2})->latency(Latency::heartbeat);
    CHECK(bert.at("rtt_ms_p50") == rtt.p50_ms);
    CHECK(bert.at("rtt_ms_p95") == rtt.p95_ms);
    CHECK(rtt.p50_ms < rtt.p95_ms);
    CHECK(json["samples"] == 1064);
    CHECK(json["client"]["samples"] == 1000);
}
