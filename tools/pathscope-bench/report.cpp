#include <fmt/format.h>
#include <sys/utsname.h>

#include <fstream>

#include "bench.hpp"
#include "commit.hpp"
#include "pathscope/core/parallel_for.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope::bench {
namespace {

std::string processor_name() {
    std::ifstream cpuinfo("/proc/cpuinfo");
    for (std::string line; std::getline(cpuinfo, line);)
        if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
    return "unknown processor";
}

/// What the figures depend on; not the machine's name, which is nobody's business.
std::string machine() {
    utsname system{};
    uname(&system);
    return fmt::format("{}, {} threads, {} {} {}", processor_name(), hardware_threads(), system.sysname,
                       system.release, system.machine);
}

}  // namespace

std::string report_json(const BenchOptions& options, const Report& report) {
    nlohmann::ordered_json file{
        {"bench", options.name},     {"machine", machine()}, {"commit", k_commit},
        {"build", build_identity()}, {"runs", options.runs},
    };
    file.update(report.extra);
    file["rows"] = report.rows;
    return file.dump(2) + "\n";
}

}  // namespace pathscope::bench
