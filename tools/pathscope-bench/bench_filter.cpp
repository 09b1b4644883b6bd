/// filter: how long do the filters take on a picture of the window's size, and how much error do they take away?
///
/// The picture is noise over tiles that face six ways, in two colours, on a floor that recedes: as in a rendering, most
/// neighbours of a pixel lie on its own surface, and some beyond an edge. The time hardly depends on it, as
/// the filter looks at each neighbour either way. The error is measured on the scenes that are named (filter_error.hpp).

#include <fmt/format.h>

#include <array>

#include "bench.hpp"
#include "filter_error.hpp"
#include "measure.hpp"
#include "pathscope/core/parallel_for.hpp"
#include "pathscope/filter/atrous.hpp"
#include "pathscope/filter/joint_bilateral.hpp"
#include "pathscope/math/random.hpp"
#include "terminal.hpp"

namespace pathscope::bench {
namespace {

struct Picture {
    Image noisy;
    Guides guides;
};

Picture make_picture(int width, int height) {
    constexpr int k_tile = 40;
    constexpr std::array<Vec3, 6> k_normals{Vec3{1, 0, 0}, {0, 1, 0},  {0, 0, 1},
                                            {-1, 0, 0},    {0, -1, 0}, {0, 0, -1}};
    Picture picture{Image(width, height), {Image(width, height), Image(width, height), Plane(width, height)}};
    HashRng rng(1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int tile = x / k_tile + y / k_tile * 7;
            const float albedo = tile % 2 == 0 ? 0.2f : 0.7f;
            picture.guides.normal.at(x, y) = k_normals[std::size_t(tile) % k_normals.size()];
            picture.guides.albedo.at(x, y) = {albedo, albedo, albedo};
            picture.guides.depth.at(x, y) = 1 + float(height - y) / float(height);
            picture.noisy.at(x, y) = Rgb{1, 1, 1} * (albedo * 2 * rng.next_float());
        }
    return picture;
}

/// One way of filtering. A new one is a line here.
struct Variant {
    const char* name;
    int radius;  ///< How far from a pixel its value may come.
    Image (*filter)(const Picture& picture, int threads);
};

template <int radius>
Image run_bilateral(const Picture& picture, int threads) {
    BilateralParams params;
    params.radius = radius;
    params.sigma_spatial = float(radius) / 2;
    return joint_bilateral(picture.noisy, picture.guides, params, threads);
}

template <int levels>
Image run_atrous(const Picture& picture, int threads) {
    AtrousParams params;
    params.levels = levels;
    return atrous(picture.noisy, picture.guides, params, threads);
}

constexpr std::array k_variants{
    Variant{"joint_bilateral", 5, run_bilateral<5>}, Variant{"joint_bilateral", 7, run_bilateral<7>},
    Variant{"atrous", atrous_reach(3), run_atrous<3>}, Variant{"atrous", atrous_reach(5), run_atrous<5>}};

struct Case {
    int threads;
    const Variant* variant;
};

}  // namespace

Result<Report> bench_filter(const BenchOptions& options) {
    const auto [width, height] = options.size.value_or(std::pair(1280, 720));
    const std::vector<int> threads = options.threads.empty() ? std::vector{1, 2} : options.threads;
    for (const int count : threads)
        if (count > hardware_threads())
            return bad_input(fmt::format("--threads {}: this machine has {}.", count, hardware_threads()));

    show_progress("filter");
    const Picture picture = make_picture(width, height);
    std::vector<Case> cases;
    for (const Variant& variant : k_variants)
        for (const int count : threads) cases.push_back({count, &variant});
    std::vector<std::function<Cost()>> passes;
    for (const Case& c : cases)
        passes.push_back([&] { return cost_of([&] { (void)c.variant->filter(picture, c.threads); }); });
    const auto costs = interleave(options.runs, passes);
    show_progress("");

    Report report;
    TextTable table({"variant", "size", "radius", "threads", "ms", "CPU ms"});
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const Case& c = cases[i];
        const Cost cost = median(costs[i]);
        const double ms = 1e3 * cost.wall_s, cpu_ms = 1e3 * cost.cpu_s;
        report.rows.push_back({{"width", width},
                               {"height", height},
                               {"radius", c.variant->radius},
                               {"threads", c.threads},
                               {"variant", c.variant->name},
                               {"ms", ms},
                               {"cpu_ms", cpu_ms}});
        table.add({c.variant->name, fmt::format("{}x{}", width, height), std::to_string(c.variant->radius),
                   std::to_string(c.threads), fmt::format("{:.1f}", ms), fmt::format("{:.1f}", cpu_ms)});
    }
    table.print();

    Result<nlohmann::ordered_json> errors = measure_filter_errors(options);
    if (!errors) return errors.error();
    report.extra["errors"] = std::move(*errors);
    return report;
}

}  // namespace pathscope::bench
