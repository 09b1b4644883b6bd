/// pathscope-render: the headless client.

#include <atomic>
#include <csignal>
#include <cstdio>

#include "../common/arguments.hpp"
#include "run.hpp"

namespace {
std::atomic<bool> g_interrupted{false};
void interrupt(int) { g_interrupted.store(true); }
}  // namespace

int main(int argc, char** argv) {
    using namespace pathscope;
    const auto options = parse_options(argc, argv);
    if (!options) return report("pathscope-render", options.error());
    if (const auto* text = std::get_if<std::string>(&*options)) {
        std::fputs(text->c_str(), stdout);
        return 0;
    }
    std::signal(SIGINT, interrupt);
    std::signal(SIGTERM, interrupt);
    const auto done = run_render(std::get<RenderOptions>(*options), g_interrupted);
    return done ? 0 : report("pathscope-render", done.error());
}
