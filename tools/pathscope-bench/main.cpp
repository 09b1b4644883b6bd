/// pathscope-bench: measures this program's parts, and their peers in the same run.

#include <algorithm>
#include <cstdio>

#include "../common/arguments.hpp"
#include "bench.hpp"
#include "measure.hpp"
#include "pathscope/core/files.hpp"
#include "terminal.hpp"

namespace {

using namespace pathscope;
using namespace pathscope::bench;

void add_options(CLI::App& app, BenchOptions& options) {
    std::string names = "which benchmark";
    for (const Bench& bench : bench_table())
        names.append("\n").append(bench.name).append(": ").append(bench.does);
    const CLI::Range samples(1, int(k_max_samples_per_pixel));
    app.add_option("NAME", options.name, names)->required()->type_name("");
    app.add_option("--json", options.json, "write rows, machine and commit here")->type_name("FILE");
    app.add_option("--runs", options.runs, "rounds that count, after one that does not (5)")
        ->check(CLI::Range(k_min_runs, 1000))
        ->type_name("N");
    app.add_option("--scenes", options.scenes, "folder whose folders hold a scene.json each")
        ->check(CLI::ExistingDirectory)
        ->type_name("DIR");
    app.add_option("--scene", options.scene,
                   "of --scenes only this one, by name; or a further one, by path; may be repeated")
        ->allow_extra_args(false)
        ->type_name("NAME");
    app.add_option("--threads", options.threads, "numbers of threads to measure with (1; filter: 1,2)")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(1, 1024))
        ->type_name("N,...");
    app.add_option("--rays", options.rays, "bvh, trace: rays of each kind (1048576; trace: 16384)")
        ->check(CLI::Range(256, 1 << 26))
        ->type_name("N");
    add_size(app, options.size, "pixels (image: 256x144; filter: 1280x720)");
    app.add_option("--spp", options.spp, "image: most samples per pixel (16)")
        ->check(samples)
        ->type_name("N");
    app.add_option("--reference-spp", options.reference_spp,
                   "image: of the picture that is taken for true (256)")
        ->check(samples)
        ->type_name("N");
    app.add_option("--servers", options.servers, "scale, detection: numbers of servers (1,2,4,8,16; 1,8,32)")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(1, 1024))
        ->type_name("N,...");
    app.add_option("--ghosts", options.ghosts, "scale: servers of the crowd; 0 = no crowd (1000)")
        ->check(CLI::Range(0, 4096))
        ->type_name("N");
    app.add_option("--seconds", options.seconds,
                   "scale: that a frame takes if no server ever waits (2); detection: of watching for false "
                   "deaths (10)")
        ->check(CLI::Range(0.05, 86'400.0))
        ->type_name("T");
    add_lever(app, "--tree", options.tree, "trace: by which tree");
    app.add_option("--kind", options.kind, "trace: which rays (incoherent)")->type_name("NAME");
    app.add_option("--passes", options.passes, "trace: how often all rays are traced (1)")
        ->check(CLI::Range(0, 1'000'000))
        ->type_name("N");
}

/// The benchmark, if it exists and takes what was given.
Result<const Bench*> choose_bench(const CLI::App& app, const BenchOptions& options) {
    const Bench* bench = find_bench(options.name);
    if (bench == nullptr)
        return bad_input("'" + options.name + "' is no benchmark; there are " + bench_names() + ".");
    for (const CLI::Option* option : app.get_options()) {
        const std::string flag = option->get_name();
        const bool common = flag == "NAME" || flag == "--json" || flag == "--runs";
        if (option->count() > 0 && !common &&
            std::find(bench->flags.begin(), bench->flags.end(), flag) == bench->flags.end())
            return bad_input(flag + ": " + options.name + " does not take this flag.");
    }
    return bench;
}

Result<void> run(const Bench& bench, const BenchOptions& options) {
    // What cannot be written is found out before the minutes are spent.
    if (!options.json.empty())
        if (const auto ok = write_file_atomically(options.json, ""); !ok) return ok;
    const Result<Report> report = bench.run(options);
    show_progress("");
    if (!report) return report.error();
    return options.json.empty() ? Result<void>()
                                : write_file_atomically(options.json, report_json(options, *report));
}

}  // namespace

int main(int argc, char** argv) {
    BenchOptions options;
    CLI::App app("Measures parts of Pathscope, and their peers in the same run.", "pathscope-bench");
    add_options(app, options);
    const auto text = parse_arguments(app, argc, argv);
    if (!text) return report("pathscope-bench", text.error());
    if (*text) {
        std::fputs((*text)->c_str(), stdout);
        return 0;
    }
    const auto bench = choose_bench(app, options);
    if (!bench) return report("pathscope-bench", bench.error());
    const auto done = run(**bench, options);
    return done ? 0 : report("pathscope-bench", done.error());
}
