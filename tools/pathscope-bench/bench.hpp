#pragma once
/// A benchmark: a name, the flags it takes, and a function from options to rows.
///
/// Each lives in a file of its own, bench_NAME.cpp; bench_table() in benches.cpp lists them all.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pathscope/bvh/tree.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope::bench {

/// What the command line says. Where it says nothing, each benchmark has a default of its own.
struct BenchOptions {
    std::string name;
    std::filesystem::path json;      ///< Empty: the table on the terminal is all.
    std::filesystem::path scenes;    ///< A folder whose folders hold a scene.json each.
    std::vector<std::string> scene;  ///< Folders of it by name, or paths of scenes.
    std::vector<int> threads;
    int runs = 5;  ///< That are counted, after one that is not.
    std::optional<std::size_t> rays;
    std::optional<std::pair<int, int>> size;  ///< In pixels.
    std::optional<int> spp, reference_spp;
    TreeKind tree = TreeKind::wide;
    std::string kind = "incoherent";  ///< Of rays: ray_sets.hpp.
    int passes = 1;
    std::vector<int> servers;       ///< How many, for each row.
    int ghosts = 1000;              ///< In its crowd.
    std::optional<double> seconds;  ///< `scale`: of a frame. `detection`: of watching.
    std::uint32_t crowd_spp = 64;
};

/// What goes into the JSON beside machine and commit.
struct Report {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    nlohmann::ordered_json extra = nlohmann::ordered_json::object();  ///< Further keys of the file.
};

struct Bench {
    std::string_view name;
    std::string_view does;
    std::vector<std::string_view> flags;  ///< Besides --json and --runs, which all take.
    Result<Report> (*run)(const BenchOptions&);
};

[[nodiscard]] const std::vector<Bench>& bench_table();
[[nodiscard]] const Bench* find_bench(std::string_view name);
[[nodiscard]] std::string bench_names();  ///< "bvh, filter": for help and errors.

[[nodiscard]] Result<Report> bench_bvh(const BenchOptions& options);
[[nodiscard]] Result<Report> bench_detection(const BenchOptions& options);
[[nodiscard]] Result<Report> bench_filter(const BenchOptions& options);
[[nodiscard]] Result<Report> bench_image(const BenchOptions& options);
[[nodiscard]] Result<Report> bench_ledger(const BenchOptions& options);
[[nodiscard]] Result<Report> bench_limits(const BenchOptions& options);
[[nodiscard]] Result<Report> bench_scale(const BenchOptions& options);
[[nodiscard]] Result<Report> bench_trace(const BenchOptions& options);

/// {"bench", "machine", "commit", "version", "runs", "rows", ...}, as docs/performance.md explains them.
[[nodiscard]] std::string report_json(const BenchOptions& options, const Report& report);

}  // namespace pathscope::bench
