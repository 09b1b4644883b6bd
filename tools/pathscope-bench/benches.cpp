#include "bench.hpp"

namespace pathscope::bench {

const std::vector<Bench>& bench_table() {
    static const std::vector<Bench> table{
        {"bvh",
         "rays per second of the trees, and of Embree",
         {"--scenes", "--scene", "--threads", "--rays"},
         bench_bvh},
        {"image",
         "samples per second, and error over time",
         {"--scenes", "--scene", "--threads", "--size", "--spp", "--reference-spp"},
         bench_image},
        {"filter",
         "the filters: their time, and with scenes the error before and after",
         {"--threads", "--size", "--scenes", "--scene", "--spp", "--reference-spp"},
         bench_filter},
        {"ledger", "tiles per second through ledger and schedule", {}, bench_ledger},
        {"scale",
         "what N servers are worth, a crowd of ghosts, and with a scene one server beside none",
         {"--servers", "--ghosts", "--seconds", "--scene", "--spp"},
         bench_scale},
        {"detection",
         "how long until a server that was killed or frozen counts as dead",
         {"--servers", "--seconds", "--scene", "--scenes"},
         bench_detection},
        {"limits", "what a core can do at most: arithmetic, bandwidth, latency", {}, bench_limits},
        {"trace",
         "passes over one set of rays, for tools that count instructions",
         {"--scenes", "--scene", "--rays", "--tree", "--kind", "--passes"},
         bench_trace},
    };
    return table;
}

const Bench* find_bench(std::string_view name) {
    for (const Bench& bench : bench_table())
        if (bench.name == name) return &bench;
    return nullptr;
}

std::string bench_names() {
    std::string names;
    for (const Bench& bench : bench_table()) names.append(names.empty() ? "" : ", ").append(bench.name);
    return names;
}

}  // namespace pathscope::bench
