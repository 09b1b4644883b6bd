#include "options.hpp"

#include <fmt/format.h>

#include "../common/arguments.hpp"
#include "pathscope/core/files.hpp"

namespace pathscope {
namespace {

constexpr int k_highest_port = 65535;

/// "127.0.0.1:6555,6556,6557", "[::1]:0" -> host and ports.
void add_endpoint(CLI::App& app, const std::string& flag, std::string& host, std::vector<int>& ports,
                  int lowest_port, const std::string& help) {
    const auto assign = [flag, &host, &ports, lowest_port](const std::string& text) {
        const std::size_t colon = std::min(text.rfind(':'), text.size());
        host = text.substr(0, colon);
        if (host.size() > 2 && host.front() == '[' && host.back() == ']')
            host = host.substr(1, host.size() - 2);
        ports.clear();
        bool good = !host.empty() && colon + 1 < text.size() && text.back() != ',';
        for (const std::string& part : CLI::detail::split(good ? text.substr(colon + 1) : "", ',')) {
            int port = -1;
            good = good && CLI::detail::lexical_cast(part, port) && port >= lowest_port &&
                   port <= k_highest_port;
            ports.push_back(port);
        }
        if (!good)
            throw CLI::ValidationError(
                flag,
                fmt::format("'{}' is not a host and ports from {} to {}, as in 127.0.0.1:6555,6556,6557",
                            text, lowest_port, k_highest_port));
    };
    app.add_option_function<std::string>(flag, assign, help)->type_name("HOST:PORTS")->required();
}

}  // namespace

Result<std::variant<ChaosOptions, std::string>> parse_chaos_options(int argc, const char* const* argv) {
    ChaosOptions options;
    CLI::App app(
        "Relays TCP connections and disturbs them: delay, jitter, rate limit, cut, half-close, black hole, "
        "flipped "
        "bytes. Commands come from --schedule and from standard input, as in: fault delay 80ms jitter 20ms. "
        "Ends "
        "with Ctrl+C.",
        "pathscope-chaos");
    add_endpoint(app, "--listen", options.relay.listen_host, options.relay.listen_ports, 0,
                 "where connections come in; 0 = any free port, printed");
    add_endpoint(app, "--connect", options.relay.target_host, options.relay.target_ports, 1,
                 "where they lead to, port by port");
    app.add_option("--seed", options.relay.seed, "of jitter and flips (1)")->type_name("N");
    app.add_option("--schedule", options.schedule_file, "lines of TIME COMMAND, as in: 1.5s fault cut")
        ->type_name("FILE");
    app.add_option("--stats", options.stats_file, "write connections, bytes and faults as JSON at the end")
        ->type_name("FILE");
    app.add_flag("--insecure", options.relay.open_to_others,
                 "listen on other addresses than this machine's own");

    const auto text = parse_arguments(app, argc, argv);
    if (!text) return text.error();
    if (*text) return std::variant<ChaosOptions, std::string>(**text);
    if (options.relay.listen_ports.size() != options.relay.target_ports.size())
        return bad_input(fmt::format("--listen names {} ports and --connect {}; they go in pairs.",
                                     options.relay.listen_ports.size(), options.relay.target_ports.size()));
    if (!options.schedule_file.empty()) {
        const auto text_of_file = read_file(options.schedule_file);
        if (!text_of_file) return text_of_file.error();
        auto lines = parse_chaos_schedule(*text_of_file);
        if (!lines) return bad_input(fmt::format("{}: {}", options.schedule_file, lines.error().message));
        options.schedule = std::move(*lines);
    }
    return std::variant<ChaosOptions, std::string>(std::move(options));
}

}  // namespace pathscope
