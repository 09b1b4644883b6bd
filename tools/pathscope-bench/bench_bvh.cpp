/// bvh: how many rays a second do our trees answer, and Embree in the same minute?
///
/// For each scene and number of threads: all tracers build, taking turns, and the median counts. Then, for each set of
/// rays, all calls of all tracers trace it, taking turns. ratio_vs_embree is the median over the rounds of ours / Embree's,
/// both of one round, with that call of Embree's whose median is the best.

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <tuple>

#include "bench.hpp"
#include "measure.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/scene/load.hpp"
#include "scene_list.hpp"
#include "terminal.hpp"
#include "trace_rate.hpp"

namespace pathscope::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t k_default_rays = 1024 * 1024;  ///< Of each kind.

/// Two trees agree on a ray if both miss, or hit at distances that differ by less than this fraction.
constexpr float k_same_distance = 1e-3f;

/// The rivals: our trees, and Embree behind them if this program has it.
struct Rivals {
    std::vector<std::unique_ptr<Tracer>> ours = make_our_tracers();
    std::unique_ptr<Tracer> embree = make_embree_tracer();

    [[nodiscard]] std::vector<Tracer*> all() const {
        std::vector<Tracer*> tracers;
        for (const auto& tracer : ours) tracers.push_back(tracer.get());
        if (embree) tracers.push_back(embree.get());
        return tracers;
    }
};

/// One call of one tracer: what it answered, and how fast in each round.
struct Timing {
    const Tracer* tracer = nullptr;
    TraceCall call;
    std::vector<Answer> answers;
    std::vector<double> rates;  ///< Million rays per second.

    [[nodiscard]] double rate() const { return median(rates); }
};

/// Median cost of building, of each tracer; afterwards each holds its tree.
std::map<const Tracer*, Cost> build_all(const Rivals& rivals, const Mesh& mesh, int threads, int runs) {
    const std::vector<Tracer*> tracers = rivals.all();
    std::vector<std::function<Cost()>> builds;
    for (Tracer* tracer : tracers)
        builds.push_back([tracer, &mesh, threads] { return tracer->build(mesh, threads); });
    const auto costs = interleave(runs, builds);
    std::map<const Tracer*, Cost> medians;
    for (std::size_t i = 0; i < tracers.size(); ++i) medians[tracers[i]] = median(costs[i]);
    return medians;
}

std::vector<Timing> time_calls(const Rivals& rivals, const RaySet& set, std::span<const int> processors,
                               int runs) {
    std::vector<Timing> timings;
    for (const Tracer* tracer : rivals.all())
        for (TraceCall& call : tracer->calls(set.query, set.coherent))
            timings.push_back({tracer, std::move(call), std::vector<Answer>(set.rays.size()), {}});
    std::vector<std::function<double()>> passes;
    for (Timing& timing : timings)
        passes.push_back([&] { return trace_rate(timing.call, set.rays, timing.answers, processors); });
    auto rates = interleave(runs, passes);
    for (std::size_t i = 0; i < timings.size(); ++i) timings[i].rates = std::move(rates[i]);
    return timings;
}

/// The fastest rival call of a tracer; null if the tracer is not there.
const Timing* fastest(const std::vector<Timing>& timings, const Tracer* tracer) {
    const Timing* best = nullptr;
    for (const Timing& timing : timings)
        if (timing.tracer == tracer && timing.call.is_rival &&
            (best == nullptr || timing.rate() > best->rate()))
            best = &timing;
    return best;
}

std::size_t disagreements(RayQuery query, const std::vector<Answer>& a, const std::vector<Answer>& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const bool far = query == RayQuery::closest && a[i].hit() && b[i].hit() &&
                         std::abs(a[i].t - b[i].t) > k_same_distance * b[i].t;
        if (a[i].hit() != b[i].hit() || far) ++count;
    }
    return count;
}

Json rates_of(const std::vector<Timing>& timings, const Tracer* tracer) {
    Json rates = Json::object();
    for (const Timing& timing : timings)
        if (timing.tracer == tracer) rates[timing.call.name] = timing.rate();
    return rates;
}

void add_comparison(Json& row, RayQuery query, const Timing& ours, const Timing* embree,
                    const std::vector<Timing>& timings) {
    for (const char* key : {"embree_mrays_per_s", "ratio_vs_embree", "ratio_min", "ratio_max", "embree_call",
                            "embree_calls", "disagreements"})
        row[key] = nullptr;
    if (embree == nullptr) return;
    std::vector<double> ratios;
    for (std::size_t run = 0; run < ours.rates.size(); ++run)
        ratios.push_back(ours.rates[run] / embree->rates[run]);
    row["embree_mrays_per_s"] = embree->rate();
    row["ratio_vs_embree"] = median(ratios);
    row["ratio_min"] = *std::min_element(ratios.begin(), ratios.end());
    row["ratio_max"] = *std::max_element(ratios.begin(), ratios.end());
    row["embree_call"] = embree->call.name;
    row["embree_calls"] = rates_of(timings, embree->tracer);
    row["disagreements"] = disagreements(query, ours.answers, embree->answers);
}

double hit_fraction(const std::vector<Answer>& answers) {
    const auto hits = std::count_if(answers.begin(), answers.end(), [](const Answer& a) { return a.hit(); });
    return double(hits) / double(answers.size());
}

void add_counts(Json& row, const Tracer& tracer, const RaySet& set) {
    for (const char* key : {"nodes_per_ray", "boxes_per_ray", "triangles_per_ray"}) row[key] = nullptr;
    const std::optional<TraversalCounts> counts = tracer.count(set.query, set.rays);
    if (!counts) return;
    const double rays = double(set.rays.size());
    row["nodes_per_ray"] = double(counts->nodes) / rays;
    row["boxes_per_ray"] = double(counts->boxes) / rays;
    row["triangles_per_ray"] = double(counts->triangles) / rays;
}

/// What a row says about the trees, whatever the rays.
void add_trees(Json& row, const Tracer& ours, const Tracer* embree, double triangles,
               const std::map<const Tracer*, Cost>& builds) {
    row["build_s"] = builds.at(&ours).wall_s;
    row["embree_build_s"] = embree ? Json(builds.at(embree).wall_s) : Json();
    row["build_cpu_s"] = builds.at(&ours).cpu_s;
    row["embree_build_cpu_s"] = embree ? Json(builds.at(embree).cpu_s) : Json();
    row["bytes_per_triangle"] = double(ours.bytes()) / triangles;
    row["embree_bytes_per_triangle"] = embree ? Json(double(embree->bytes()) / triangles) : Json();
}

/// For each number of threads, the processors that they run on.
using Placements = std::vector<std::vector<int>>;

Result<Placements> choose_placements(const BenchOptions& options) {
    Placements placements;
    for (const int threads : options.threads.empty() ? std::vector{1} : options.threads) {
        Result<std::vector<int>> processors = choose_processors(threads);
        if (!processors) return processors.error();
        placements.push_back(std::move(*processors));
    }
    return placements;
}

/// What the rows of one scene on one number of threads have in common.
struct SceneRun {
    const Rivals& rivals;
    std::string name;
    const Mesh& mesh;
    const std::vector<int>& processors;
    int runs;
    std::map<const Tracer*, Cost> builds = build_all(rivals, mesh, int(processors.size()), runs);
};

/// One row for each of our trees.
Json rows_of_set(const SceneRun& run, const RaySet& set) {
    const Tracer* embree = run.rivals.embree.get();
    const std::vector<Timing> timings = time_calls(run.rivals, set, run.processors, run.runs);
    Json rows = Json::array();
    for (const auto& tracer : run.rivals.ours) {
        const Timing& ours = *fastest(timings, tracer.get());
        Json row{{"scene", run.name},
                 {"triangles", run.mesh.triangle_count()},
                 {"rays", set.name},
                 {"ray_count", set.rays.size()},
                 {"threads", run.processors.size()},
                 {"ours", tracer->name()},
                 {"our_call", ours.call.name},
                 {"our_calls", rates_of(timings, tracer.get())},
                 {"mrays_per_s", ours.rate()},
                 {"hit_fraction", hit_fraction(ours.answers)}};
        add_comparison(row, set.query, ours, fastest(timings, embree), timings);
        add_trees(row, *tracer, embree, run.mesh.triangle_count(), run.builds);
        add_counts(row, *tracer, set);
        rows.push_back(std::move(row));
    }
    return rows;
}

/// All rows of one scene.
Result<Json> bench_scene(const Rivals& rivals, const SceneChoice& choice, const Placements& placements,
                         const BenchOptions& options) {
    show_progress(fmt::format("{}: load", choice.name));
    Result<OpenedScene> opened = open_scene(choice.path, {});
    if (!opened) return opened.error();
    const Result<Scene> scene = make_scene(opened->file, std::move(opened->parts));
    if (!scene) return scene.error();
    if (bounds(scene->mesh).empty())
        return bad_input(fmt::format("{}: has no triangles to measure with.", choice.path.string()));
    show_progress(fmt::format("{}: make rays", choice.name));
    const std::vector<RaySet> sets =
        make_ray_sets(*scene, opened->file.cameras.front().view, options.rays.value_or(k_default_rays));
    for (const RaySet& set : sets)
        if (set.rays.empty())
            log_note(fmt::format("{}: no ray of the kind {} comes about; its row is left out.", choice.name,
                                 set.name));

    Json rows = Json::array();
    for (const std::vector<int>& processors : placements) {
        show_progress(fmt::format("{}: build, {} threads", choice.name, processors.size()));
        const SceneRun run{rivals, choice.name, scene->mesh, processors, options.runs};
        for (const RaySet& set : sets) {
            if (set.rays.empty()) continue;
            show_progress(fmt::format("{}: {} rays, {} threads", choice.name, set.name, processors.size()));
            for (Json& row : rows_of_set(run, set)) rows.push_back(std::move(row));
        }
    }
    return rows;
}

/// Geometric means over the scenes, of each tree, kind of rays and number of threads.
Json summarise(const Json& rows) {
    struct Ratios {
        std::vector<double> rays, builds;
    };
    std::vector<std::tuple<std::string, std::string, int>> order;
    std::map<std::tuple<std::string, std::string, int>, Ratios> groups;
    for (const Json& row : rows) {
        if (row["ratio_vs_embree"].is_null()) continue;
        const std::tuple key(row["ours"].get<std::string>(), row["rays"].get<std::string>(),
                             row["threads"].get<int>());
        if (!groups.contains(key)) order.push_back(key);
        groups[key].rays.push_back(row["ratio_vs_embree"]);
        groups[key].builds.push_back(row["build_s"].get<double>() / row["embree_build_s"].get<double>());
    }
    Json summary = Json::array();
    for (const auto& key : order) {
        const auto& [ours, rays, threads] = key;
        const Ratios& ratios = groups[key];
        summary.push_back({{"ours", ours},
                           {"rays", rays},
                           {"threads", threads},
                           {"scenes", ratios.rays.size()},
                           {"ratio_vs_embree", geometric_mean(ratios.rays)},
                           {"lowest", *std::min_element(ratios.rays.begin(), ratios.rays.end())},
                           {"build_ratio", geometric_mean(ratios.builds)}});
    }
    return summary;
}

std::string cell(const Json& value, const char* format = "{:.2f}") {
    return value.is_null() ? "-" : fmt::format(fmt::runtime(format), value.get<double>());
}

void print_tables(const Report& report) {
    TextTable table({"scene", "triangles", "rays", "threads", "ours", "Mrays/s", "Embree", "ratio", "by",
                     "build s", "Embree", "B/tri", "Embree", "boxes/ray", "tris/ray", "differ"});
    for (const Json& row : report.rows)
        table.add({row["scene"], cell(row["triangles"], "{:.0f}"), row["rays"],
                   cell(row["threads"], "{:.0f}"), row["ours"], cell(row["mrays_per_s"]),
                   cell(row["embree_mrays_per_s"]), cell(row["ratio_vs_embree"]),
                   row["embree_call"].is_null() ? "-" : row["embree_call"].get<std::string>(),
                   cell(row["build_s"], "{:.3f}"), cell(row["embree_build_s"], "{:.3f}"),
                   cell(row["bytes_per_triangle"], "{:.0f}"),
                   cell(row["embree_bytes_per_triangle"], "{:.0f}"), cell(row["boxes_per_ray"], "{:.1f}"),
                   cell(row["triangles_per_ray"], "{:.1f}"), cell(row["disagreements"], "{:.0f}")});
    table.print();

    const Json& summary = report.extra["summary"];
    if (summary.empty()) return;
    fmt::print("\nGeometric mean over the scenes, Embree = 1\n");
    TextTable means({"ours", "rays", "threads", "scenes", "ratio", "lowest", "build"});
    for (const Json& row : summary)
        means.add({row["ours"], row["rays"], cell(row["threads"], "{:.0f}"), cell(row["scenes"], "{:.0f}"),
                   cell(row["ratio_vs_embree"], "{:.3f}"), cell(row["lowest"], "{:.3f}"),
                   cell(row["build_ratio"])});
    means.print();
}

}  // namespace

Result<Report> bench_bvh(const BenchOptions& options) {
    const Result<std::vector<SceneChoice>> scenes = list_scenes(options);
    if (!scenes) return scenes.error();
    const Result<Placements> placements = choose_placements(options);
    if (!placements) return placements.error();
    const Rivals rivals;
    if (!rivals.embree)
        log_note("This program was built without Embree (libembree-dev); its columns stay empty.");

    Report report;
    report.extra["peer"] = rivals.embree ? Json(rivals.embree->name()) : Json();
    for (const SceneChoice& scene : *scenes) {
        Result<Json> rows = bench_scene(rivals, scene, *placements, options);
        if (!rows) return rows.error();
        for (Json& row : *rows) report.rows.push_back(std::move(row));
    }
    show_progress("");
    report.extra["summary"] = summarise(report.rows);
    print_tables(report);
    return report;
}

}  // namespace pathscope::bench
