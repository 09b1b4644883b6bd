#include "pathscope/session/stats.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

#include "pathscope/core/check.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

using Json = nlohmann::ordered_json;

double per_second(std::uint64_t count, double seconds) { return seconds > 0 ? double(count) / seconds : 0; }

Json servers_json(const EventStore& store) {
    Json servers = Json::array();
    for (const ServerSummary& server : store.servers()) {
        if (server.id == k_local_server) continue;
        const LatencySummary& rtt = server.latency(Latency::heartbeat);
        const LatencySummary& tile = server.latency(Latency::tile);
        servers.push_back({{"id", server.id.value},
                           {"name", server.name},
                           {"samples", server.total(Counter::samples)},
                           {"tiles", server.total(Counter::tiles)},
                           {"differing_rounds", server.total(Counter::differing_rounds)},
                           {"rays", server.total(Counter::rays)},
                           {"bytes", server.total(Counter::bytes_in)},
                           {"rtt_ms_p50", rtt.p50_ms},
                           {"rtt_ms_p95", rtt.p95_ms},
                           {"tile_ms_p50", tile.p50_ms},
                           {"tile_ms_p95", tile.p95_ms},
                           {"stuck", server.total(Counter::stuck)},
                           {"died", server.total(Counter::died) > 0}});
    }
    return servers;
}

Json resumed_json(const std::optional<WorkHistory>& history) {
    if (!history) return {};
    return {{"runs", history->runs},
            {"rounds", history->rounds},
            {"samples", history->samples},
            {"rays", history->rays},
            {"render_s", history->render_s}};
}

}  // namespace

SamplesPerPixel summary_of(const Plane& samples) {
    CHECK(!samples.pixels.empty());
    const auto [least, most] = std::minmax_element(samples.pixels.begin(), samples.pixels.end());
    double sum = 0;
    for (const float n : samples.pixels) sum += double(n);
    return {double(*least), sum / double(samples.pixels.size()), double(*most)};
}

SceneMemory memory_of(const Scene& scene) {
    const auto bytes = [](const auto& table) { return table.size() * sizeof(table[0]); };
    const Mesh& mesh = scene.mesh;
    return {mesh.triangle_count(),
            bytes(mesh.positions) + bytes(mesh.normals) + bytes(mesh.uvs) + bytes(mesh.triangles) +
                bytes(mesh.materials),
            tree_bytes(scene.tree)};
}

std::string stats_json(const RenderState& state, const EventStore& store, const RunFigures& figures) {
    const CounterTotals totals = store.totals();
    const auto per_triangle = [&](std::size_t bytes) {
        return double(bytes) / std::max<double>(1, figures.memory.triangles);
    };
    const auto total = [&](Counter counter) { return totals[std::size_t(counter)]; };
    const auto local = store.server(k_local_server);

    Json json{{"version", program_version()},
              {"build", build_identity()},
              {"scene", state.scene.name},
              {"width", state.settings.width},
              {"height", state.settings.height},
              {"spp", state.settings.spp},
              {"direct_spp", state.settings.direct_spp},
              {"seed", state.settings.seed},
              {"threads", figures.threads},
              {"strategy", name_of(figures.strategy)},
              {"wall_s", figures.wall_s},
              {"load_s", figures.load_s},
              {"build_s", figures.build_s},
              {"render_s", figures.render_s},
              {"triangles", figures.memory.triangles},
              {"mesh_bytes_per_triangle", per_triangle(figures.memory.mesh_bytes)},
              {"bvh_bytes_per_triangle", per_triangle(figures.memory.tree_bytes)},
              {"rays", total(Counter::rays)},
              {"rays_per_s", per_second(total(Counter::rays), figures.render_s)},
              {"samples", total(Counter::samples)},
              {"samples_per_s", per_second(total(Counter::samples), figures.render_s)},
              {"image_hash", to_hex(figures.image_hash)},
              {"reproducible", figures.reproducible},
              {"estimated_error", figures.estimated_error ? Json(*figures.estimated_error) : Json()},
              {"samples_per_pixel_min", figures.samples_per_pixel.min},
              {"samples_per_pixel_mean", figures.samples_per_pixel.mean},
              {"samples_per_pixel_max", figures.samples_per_pixel.max},
              {"quantum_exponent", state.settings.quantum.exponent},
              {"wire", std::string(name_of(state.settings.wire))},
              {"servers", servers_json(store)},
              {"client",
               {{"samples", local ? local->total(Counter::samples) : 0},
                {"rays", local ? local->total(Counter::rays) : 0}}},
              {"resumed", resumed_json(figures.resumed)}};
    // The counters have one name everywhere; those above have the units that people expect.
    for (const auto& [counter, name] : k_counter_names)
        if (!json.contains(name)) json[std::string(name)] = total(counter);
    json["saturated"] = figures.saturated;
    json["dropped_samples"] = Json::array();
    for (const DroppedSample& dropped : figures.dropped)
        json["dropped_samples"].push_back({{"x", dropped.x}, {"y", dropped.y}, {"sample", dropped.sample}});
    return json.dump(2) + "\n";
}

}  // namespace pathscope
