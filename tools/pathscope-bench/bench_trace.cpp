/// trace: some passes over one set of rays by one of our trees, and nothing else.
///
/// For tools that watch a process from outside and know nothing of what it does. Two runs that differ in the number of passes
/// alone differ by the work of these passes: loading, making the rays and building the tree cancel out
/// (tools/count-instructions). No peer, no warm-up, no other thread while rays are traced; --runs has no say.

#include <fmt/format.h>

#include <algorithm>

#include "bench.hpp"
#include "pathscope/core/log.hpp"
#include "scene_list.hpp"
#include "terminal.hpp"
#include "tracer.hpp"

namespace pathscope::bench {
namespace {

constexpr std::size_t k_default_rays = 16384;

Result<RaySet> find_set(std::vector<RaySet> sets, const std::string& kind) {
    std::string names;
    for (RaySet& set : sets) {
        if (set.name == kind) return std::move(set);
        names.append(names.empty() ? "" : ", ").append(set.name);
    }
    return bad_input(fmt::format("--kind '{}': there are {}.", kind, names));
}

std::unique_ptr<Tracer> find_tracer(TreeKind tree) {
    for (auto& tracer : make_our_tracers())
        if (tracer->name() == name_of(tree)) return std::move(tracer);
    CHECK(false, name_of(tree));
    return nullptr;
}

/// All rays, batch by batch, as often as asked for. Returns how many hit in the last pass.
std::size_t trace(const TraceCall& call, std::span<const Ray> rays, int passes) {
    std::vector<Answer> answers(rays.size());
    for (int pass = 0; pass < passes; ++pass)
        for (std::size_t first = 0; first < rays.size(); first += k_batch_rays) {
            const std::size_t count = std::min(k_batch_rays, rays.size() - first);
            call.trace(rays.subspan(first, count), std::span(answers).subspan(first, count));
        }
    return std::size_t(
        std::count_if(answers.begin(), answers.end(), [](const Answer& answer) { return answer.hit(); }));
}

}  // namespace

Result<Report> bench_trace(const BenchOptions& options) {
    const Result<std::vector<SceneChoice>> scenes = list_scenes(options);
    if (!scenes) return scenes.error();
    Report report;
    TextTable table({"scene", "rays", "count", "tree", "passes", "hits"});
    for (const SceneChoice& choice : *scenes) {
        Result<OpenedScene> opened = open_scene(choice.path, {});
        if (!opened) return opened.error();
        const Result<Scene> scene = make_scene(opened->file, std::move(opened->parts));
        if (!scene) return scene.error();
        const Result<RaySet> set = find_set(
            make_ray_sets(*scene, opened->file.cameras.front().view, options.rays.value_or(k_default_rays)),
            options.kind);
        if (!set) return set.error();
        if (set->rays.empty())
            return bad_input(fmt::format("{}: no ray of the kind {} comes about.", choice.name, set->name));
        const std::unique_ptr<Tracer> tracer = find_tracer(options.tree);
        (void)tracer->build(scene->mesh, 1);
        const std::size_t hits =
            trace(tracer->calls(set->query, set->coherent).front(), set->rays, options.passes);
        report.rows.push_back({{"scene", choice.name},
                               {"triangles", scene->mesh.triangle_count()},
                               {"rays", set->name},
                               {"ray_count", set->rays.size()},
                               {"ours", tracer->name()},
                               {"passes", options.passes},
                               {"hits", hits}});
        table.add({choice.name, std::string(set->name), std::to_string(set->rays.size()), tracer->name(),
                   std::to_string(options.passes), std::to_string(hits)});
    }
    table.print();
    return report;
}

}  // namespace pathscope::bench
