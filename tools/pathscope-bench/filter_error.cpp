#include "filter_error.hpp"

#include <fmt/format.h>

#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "measure.hpp"
#include "pathscope/filter/atrous.hpp"
#include "pathscope/image/metrics.hpp"
#include "pathscope/render/rendered_frame.hpp"
#include "pictures.hpp"
#include "scene_list.hpp"
#include "terminal.hpp"

namespace pathscope::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Filter {
    std::string name;
    std::function<Image(const Image& noisy, const Guides& guides)> run;
};

std::vector<Filter> filters() {
    std::vector<Filter> all;
    for (const int radius : {5, 7}) {
        BilateralParams params;
        params.radius = radius;
        params.sigma_spatial = float(radius) / 2;
        all.push_back({fmt::format("joint_bilateral radius {}", radius),
                       [params](const auto& noisy, const auto& guides) {
                           return joint_bilateral(noisy, guides, params);
                       }});
    }
    for (const int levels : {3, 4, 5}) {
        AtrousParams params;
        params.levels = levels;
        all.push_back(
            {fmt::format("atrous {} levels", levels),
             [params](const auto& noisy, const auto& guides) { return atrous(noisy, guides, params); }});
    }
    return all;
}

struct Task {
    const Scene& scene;
    Camera camera;
    RenderSettings settings;
};

Image render_indirect(const Task& task, std::uint32_t spp, std::uint32_t seed) {
    RenderSettings settings = task.settings;
    settings.spp = spp;
    settings.direct_spp = 0;
    settings.seed = seed;
    return render_locally(task.scene, task.camera, settings, k_block_size, 0).indirect.mean();
}

/// Medians over pictures of as many seeds as there are rounds.
struct Errors {
    std::vector<double> rmse, rel_mse;

    void add(const Image& image, const Image& truth) {
        rmse.push_back(pathscope::rmse(image, truth));
        rel_mse.push_back(pathscope::rel_mse(image, truth));
    }
};

Json measure_scene(const std::string& name, const Task& task, const BenchOptions& options) {
    const auto spp = std::uint32_t(options.spp.value_or(4));
    show_progress(fmt::format("filter: {}: reference", name));
    const Image truth =
        render_indirect(task, std::uint32_t(options.reference_spp.value_or(1024)), k_reference_seed);

    const std::vector<Filter> all = filters();
    Errors before;
    std::vector<Errors> after(all.size());
    for (int run = 0; run < options.runs; ++run) {
        show_progress(fmt::format("filter: {}: picture {} of {}", name, run + 1, options.runs));
        Task seeded = task;
        seeded.settings.seed = std::uint32_t(1 + run);
        const Image noisy = render_indirect(seeded, spp, seeded.settings.seed);
        const Guides guides = render_guides(task.scene, task.camera, seeded.settings, noisy.rect(), 0);
        before.add(noisy, truth);
        for (std::size_t i = 0; i < all.size(); ++i) after[i].add(all[i].run(noisy, guides), truth);
    }

    Json rows = Json::array();
    for (std::size_t i = 0; i < all.size(); ++i)
        rows.push_back({{"scene", name},
                        {"width", task.settings.width},
                        {"height", task.settings.height},
                        {"spp", spp},
                        {"variant", all[i].name},
                        {"rmse_before", median(before.rmse)},
                        {"rmse_after", median(after[i].rmse)},
                        {"rel_mse_before", median(before.rel_mse)},
                        {"rel_mse_after", median(after[i].rel_mse)}});
    return rows;
}

Result<Json> open_and_measure(const SceneChoice& choice, const BenchOptions& options) {
    Result<OpenedScene> opened = open_scene(choice.path, {});
    if (!opened) return opened.error();
    const Result<Scene> scene = make_scene(opened->file, std::move(opened->parts));
    if (!scene) return scene.error();

    Task task{*scene, opened->file.cameras.front().view, {}};
    std::tie(task.settings.width, task.settings.height) = options.size.value_or(std::pair(128, 128));
    task.settings.quantum = quantum_for(scene->typical_radiance, scene->brightest_radiance);
    task.settings.transport.max_bounces = opened->file.defaults.bounces.value_or(0);
    return measure_scene(choice.name, task, options);
}

void print_table(const Json& rows) {
    TextTable table({"variant", "scene", "spp", "RMSE before", "after", "relMSE before", "after"});
    const auto number = [](const Json& value) { return fmt::format("{:.3g}", value.get<double>()); };
    for (const Json& row : rows)
        table.add({row["variant"], row["scene"], std::to_string(row["spp"].get<int>()),
                   number(row["rmse_before"]), number(row["rmse_after"]), number(row["rel_mse_before"]),
                   number(row["rel_mse_after"])});
    table.print();
}

}  // namespace

Result<Json> measure_filter_errors(const BenchOptions& options) {
    Json rows = Json::array();
    if (options.scenes.empty() && options.scene.empty()) return rows;
    const Result<std::vector<SceneChoice>> scenes = list_scenes(options);
    if (!scenes) return scenes.error();
    for (const SceneChoice& scene : *scenes) {
        Result<Json> of_scene = open_and_measure(scene, options);
        if (!of_scene) return of_scene.error();
        for (Json& row : *of_scene) rows.push_back(std::move(row));
    }
    show_progress("");
    print_table(rows);
    return rows;
}

}  // namespace pathscope::bench
