/// scale: what is a number of servers worth, and how many can a client stand?
///
///     efficiency = work / (time * sum of the servers' speeds)
///
/// Servers are ghosts (session/ghost_host.hpp): as two cores cannot be sixteen machines, what a machine renders is replaced by
/// the time that it takes, and everything else is real: sockets, messages, packed tiles, the ledger, the sums. Work grows
/// with the number of servers, so that each frame takes about --seconds at perfect efficiency. With a scene, servers that
/// render, capped so far that all of them fit on the machine, are measured as well, and one without a cap beside the same
/// render in one process.

#include <fmt/format.h>

#include <algorithm>

#include "bench.hpp"
#include "fleet.hpp"
#include "measure.hpp"
#include "pathscope/render/rendered_frame.hpp"
#include "pictures.hpp"
#include "scene_list.hpp"
#include "served_job.hpp"
#include "terminal.hpp"

namespace pathscope::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr double k_ghost_speed = 200'000;   ///< Samples per second: a round of a block takes 20 ms.
constexpr double k_unlimited_speed = 1e12;  ///< Answers at once.
constexpr double k_sigma = 0.4;             ///< Of the speeds of machines that are not alike.
constexpr double k_process_speed = 20'000;  ///< Sixteen of them take half of one core.
constexpr double k_rounds_per_ghost = 32;   ///< Of the crowd.
constexpr std::uint32_t k_speed_seed = 1;

/// A picture in whole blocks, as many as the largest fleet has servers or a multiple, so that equal shares exist.
constexpr int k_width = 256, k_height = 128;

/// Of the crowd: as many blocks as full HD has at the usual size, each a quarter of that. What is asked for is how many
/// tiles a client stands, not how many bytes.
constexpr int k_crowd_block = 16;
constexpr int k_crowd_columns = 60, k_crowd_rows = 34;

/// Of whatever a ghost pretends to render.
ClientJob ghost_job() {
    const SceneFile file = *parse_scene_file(
        R"({"name": "ghosts", "obj": "ghosts.obj", "up_axis": "Y",
            "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40},
            "lights": [{"type": "sphere", "centre": [0, 0, 0], "radius": 1, "radiance": [1, 1, 1]}]})",
        "ghosts.json");
    RenderState state;
    state.scene = file;
    state.camera = file.cameras.front().view;
    return {state, std::make_shared<const Scene>(), SceneDepot()};
}

ClientConfig make_config(ScheduleKind schedule) {
    ClientConfig config;
    config.block_size = k_block_size;
    config.schedule = schedule;
    config.detector = DetectorKind::fixed;  // Patient: on a busy machine nobody shall be given up.
    config.threads = 1;
    return config;
}

std::vector<int> servers_of(const BenchOptions& options) {
    return options.servers.empty() ? std::vector{1, 2, 4, 8, 16} : options.servers;
}
double seconds_of(const BenchOptions& options) { return options.seconds.value_or(2); }

// ---- Efficiency.

struct Case {
    Fleet fleet;
    ScheduleKind schedule = ScheduleKind::pull;
    ClientConfig config;
    ClientJob job;
    std::vector<FrameFigures> figures;
};

std::vector<Case> efficiency_cases(const BenchOptions& options, const std::optional<ClientJob>& scene) {
    std::vector<Case> cases;
    for (const int servers : servers_of(options))
        for (const ScheduleKind schedule : {ScheduleKind::pull, ScheduleKind::static_shares})
            for (const double sigma : {0.0, k_sigma}) {
                Case one;
                one.fleet = {servers, true, {k_ghost_speed, sigma}, k_speed_seed, 0};
                one.schedule = schedule;
                one.config = make_config(schedule);
                one.job = sized(ghost_job(), k_width, k_height,
                                one.fleet.samples_per_second() * seconds_of(options));
                cases.push_back(std::move(one));
            }
    if (!scene) return cases;
    for (const int servers : servers_of(options)) {
        Case one;
        one.fleet = {servers, false, {}, 0, k_process_speed};
        one.config = make_config(one.schedule);
        one.config.round_samples = 1;  // As slow as they are, a round would else be a tenth of the frame.
        one.job = sized(*scene, k_width, k_height, one.fleet.samples_per_second() * seconds_of(options));
        cases.push_back(std::move(one));
    }
    return cases;
}

double efficiency(const FrameFigures& figures, const Fleet& fleet) {
    return figures.samples / (figures.render_s * fleet.samples_per_second());
}

Json efficiency_row(const Case& one) {
    std::vector<double> efficiencies, seconds;
    for (const FrameFigures& figures : one.figures) {
        efficiencies.push_back(efficiency(figures, one.fleet));
        seconds.push_back(figures.render_s);
    }
    const auto [least, most] = std::minmax_element(efficiencies.begin(), efficiencies.end());
    return {{"servers", one.fleet.servers},
            {"schedule", std::string(name_of(one.schedule))},
            {"speeds", one.fleet.speed.sigma > 0 ? "lognormal" : "equal"},
            {"kind", one.fleet.ghosts ? "ghosts" : "processes"},
            {"efficiency", median(efficiencies)},
            {"efficiency_min", *least},
            {"efficiency_max", *most},
            {"sum_of_speeds", one.fleet.samples_per_second()},
            {"samples", one.figures.front().samples},
            {"tiles", one.figures.front().tiles},
            {"s", median(seconds)}};
}

// ---- The crowd.

template <class Figure>
double median_of(const std::vector<FrameFigures>& all, Figure figure) {
    std::vector<double> values;
    for (const FrameFigures& figures : all) values.push_back(figure(figures));
    return median(std::move(values));
}

Result<Json> measure_crowd(const BenchOptions& options) {
    if (options.ghosts == 0) return Json(nullptr);
    const Fleet fleet{options.ghosts, true, {k_unlimited_speed, 0}, k_speed_seed, 0};
    ClientConfig config = make_config(ScheduleKind::pull);
    config.lease_time = 0;  // What is measured is the cost of a tile: one round each.
    config.block_size = k_crowd_block;
    const double rounds = std::max(k_rounds_per_ghost * options.ghosts, 1.0 * k_crowd_columns * k_crowd_rows);
    const double samples = rounds * k_crowd_block * k_crowd_block * config.round_samples;
    const ClientJob job =
        sized(ghost_job(), k_crowd_columns * k_crowd_block, k_crowd_rows * k_crowd_block, samples);
    std::vector<FrameFigures> all;
    for (int run = 0; run <= options.runs; ++run) {
        show_progress(fmt::format("{} ghosts: round {} of {}", options.ghosts, run, options.runs));
        const auto figures = render_frame(config, job, fleet);
        if (!figures) return figures.error();
        if (run > 0) all.push_back(*figures);
    }
    const double tiles = double(all.front().tiles);
    return Json{
        {"servers", options.ghosts},
        {"block", k_crowd_block},
        {"tiles", all.front().tiles},
        {"leases", median_of(all, [](const FrameFigures& f) { return double(f.leases); })},
        {"tiles_per_s", median_of(all, [=](const FrameFigures& f) { return tiles / f.render_s; })},
        {"tiles_per_main_cpu_s", median_of(all, [=](const FrameFigures& f) { return tiles / f.main_cpu_s; })},
        {"tiles_per_cpu_s", median_of(all, [=](const FrameFigures& f) { return tiles / f.process_cpu_s; })},
        {"join_s", median_of(all, [](const FrameFigures& f) { return f.join_s; })},
        {"client_kib_per_server", median_of(all, [](const FrameFigures& f) { return f.kib_per_server; })}};
}

// ---- One server and none.

Result<Json> measure_loopback(const std::optional<ClientJob>& scene, const BenchOptions& options) {
    if (!scene) return Json(nullptr);
    const ClientJob job = sized(*scene, 256, 256, 256.0 * 256.0 * options.spp.value_or(16));
    const ClientConfig config = make_config(ScheduleKind::pull);
    std::vector<double> local, served, ratios;
    for (int run = 0; run <= options.runs; ++run) {
        show_progress(fmt::format("one server: round {} of {}", run, options.runs));
        const auto alone = render_frame_alone(config, job);
        if (!alone) return alone.error();
        const auto one = render_frame(config, job, {1, false, {}, 0, 0});
        if (!one) return one.error();
        if (run == 0) continue;
        local.push_back(alone->samples / alone->render_s);
        served.push_back(one->samples / one->render_s);
        ratios.push_back(served.back() / local.back());
    }
    const auto [least, most] = std::minmax_element(ratios.begin(), ratios.end());
    return Json{{"local_samples_per_s", median(local)},
                {"served_samples_per_s", median(served)},
                {"ratio", median(ratios)},
                {"ratio_min", *least},
                {"ratio_max", *most}};
}

// ---- For people.

void print(const Report& report) {
    TextTable table({"servers", "kind", "schedule", "speeds", "efficiency", "min", "max", "s"});
    for (const Json& row : report.rows)
        table.add({std::to_string(row["servers"].get<int>()), row["kind"], row["schedule"], row["speeds"],
                   fmt::format("{:.3f}", row["efficiency"].get<double>()),
                   fmt::format("{:.3f}", row["efficiency_min"].get<double>()),
                   fmt::format("{:.3f}", row["efficiency_max"].get<double>()),
                   fmt::format("{:.2f}", row["s"].get<double>())});
    table.print();
    if (const Json& crowd = report.extra["crowd"]; !crowd.is_null())
        fmt::print(
            "{} ghosts: {} tiles by {:.0f} leases; {:.0f} tiles/s, {:.0f} per CPU second of the client's "
            "main thread; all joined after {:.2f} s; "
            "{:.0f} KiB of the client's memory each\n",
            crowd["servers"].get<int>(), crowd["tiles"].get<std::uint64_t>(), crowd["leases"].get<double>(),
            crowd["tiles_per_s"].get<double>(), crowd["tiles_per_main_cpu_s"].get<double>(),
            crowd["join_s"].get<double>(), crowd["client_kib_per_server"].get<double>());
    if (const Json& one = report.extra["loopback"]; !one.is_null())
        fmt::print("one server over TCP renders {:.3f} ({:.3f} to {:.3f}) of what one process does\n",
                   one["ratio"].get<double>(), one["ratio_min"].get<double>(),
                   one["ratio_max"].get<double>());
}

}  // namespace

Result<Report> bench_scale(const BenchOptions& options) {
    std::optional<ClientJob> scene;
    if (!options.scene.empty()) {
        const Result<std::vector<SceneChoice>> scenes = list_scenes(options);
        if (!scenes) return scenes.error();
        Result<ClientJob> job = scene_job(scenes->front());
        if (!job) return job.error();
        scene = std::move(*job);
    }
    Report report;
    Result<Json> crowd =
        measure_crowd(options);  // First: the memory of a fresh process is the easiest to tell.
    if (!crowd) return crowd.error();
    Result<Json> loopback = measure_loopback(scene, options);
    if (!loopback) return loopback.error();

    std::vector<Case> cases = efficiency_cases(options, scene);
    for (int run = 0; run <= options.runs; ++run)
        for (std::size_t i = 0; i < cases.size(); ++i) {
            show_progress(
                fmt::format("round {} of {}: case {} of {}", run, options.runs, i + 1, cases.size()));
            const auto figures = render_frame(cases[i].config, cases[i].job, cases[i].fleet);
            if (!figures) return figures.error();
            if (run > 0) cases[i].figures.push_back(*figures);
        }
    for (const Case& one : cases) report.rows.push_back(efficiency_row(one));
    report.extra["seconds"] = seconds_of(options);
    report.extra["crowd"] = std::move(*crowd);
    report.extra["loopback"] = std::move(*loopback);
    show_progress("");
    print(report);
    return report;
}

}  // namespace pathscope::bench
