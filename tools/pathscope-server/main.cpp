/// pathscope-server: renders indirect light for a client. No display needed.

#include <atomic>
#include <csignal>
#include <cstdio>

#include "../common/arguments.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/session/ghost_host.hpp"
#include "pathscope/session/server_session.hpp"

namespace {

using namespace pathscope;

template <class Session>
std::atomic<Session*> g_running{nullptr};

template <class Session>
void stop(int) {
    if (Session* session = g_running<Session>.load()) session->request_stop();
}

/// Until a signal or the client ends it.
template <class Session>
int run(const Result<std::unique_ptr<Session>>& session) {
    if (!session) return report("pathscope-server", session.error());
    g_running<Session>.store(session->get());
    std::signal(SIGINT, stop<Session>);
    std::signal(SIGTERM, stop<Session>);
    const auto done = (*session)->run();
    g_running<Session>.store(nullptr);
    return done ? 0 : report("pathscope-server", done.error());
}

CLI::Option* add_ghost_speed(CLI::App& app, GhostSpeed& speed) {
    const auto assign = [&speed](const std::string& text) {
        const auto parsed = parse_ghost_speed(text);
        if (!parsed) throw CLI::ValidationError("--ghost-speed", parsed.error().message);
        speed = *parsed;
    };
    return app
        .add_option_function<std::string>(
            "--ghost-speed", assign,
            "of each ghost, all alike or lognormal around that median (" + to_text(speed) + ")")
        ->type_name("SAMPLES_PER_S[,lognormal:SIGMA]");
}

}  // namespace

int main(int argc, char** argv) {
    ServerConfig config;
    GhostConfig ghosts;
    ghosts.count = 0;
    config.cache_folder = SceneCache::default_folder();
    std::string mesh_cache;
    std::string key_file, client_key;
    bool quiet = false;
    CLI::App app("Renders indirect light for a client; goes on trying until told to stop (Ctrl+C).",
                 "pathscope-server");
    app.add_option("--connect", config.host, "host of the client (127.0.0.1)")->type_name("HOST");
    add_ports(app, config.ports);
    CLI::Option* const threads =
        app.add_option("--threads", config.threads, "threads that render; 0 = all cores (0)")
            ->check(CLI::Range(0, 1024))
            ->type_name("N");
    add_lever(app, "--bvh", config.tree, "which tree finds hits");
    CLI::Option* const speed_cap = app.add_option("--speed-cap", config.samples_per_second,
                                                  "render no faster, in samples per second; 0 = no cap (0)")
                                       ->check(CLI::Range(0.0, 1e12))
                                       ->type_name("N");
    app.add_option("--name", config.name, "for people (host name and process id)")
        ->check(CLI::Validator(
            [](const std::string& name) {
                return name.empty() || name.size() > 64 ? std::string("a name has 1 to 64 bytes")
                                                        : std::string();
            },
            "NAME"))
        ->type_name("NAME");
    app.add_option("--cache", config.cache_folder, "folder for scene files, by content; safe to delete")
        ->type_name("DIR");
    add_mesh_cache(app, mesh_cache);
    const auto key = app.add_option("--key", key_file, "this server's secret key, as --keygen writes it")
                         ->type_name("FILE");
    const auto of_client =
        app.add_option("--server-key", client_key, "the client's public key, or its .pub file")
            ->type_name("KEY");
    key->needs(of_client);
    of_client->needs(key);
    add_keygen(app);
    CLI::Option* const ghost =
        app.add_option("--ghost", ghosts.count,
                       "be N servers that render nothing and answer with noise in a modelled time: for "
                       "measuring the client; 0 = a real server (0)")
            ->check(CLI::Range(1, GhostHost::k_most_ghosts))
            ->excludes(threads)
            ->excludes(speed_cap)
            ->type_name("N");
    add_ghost_speed(app, ghosts.speed)->needs(ghost);
    app.add_option("--ghost-seed", ghosts.seed, "of the ghosts' speeds (1)")->needs(ghost)->type_name("N");
    app.add_flag("--quiet", quiet, "say only what is wrong");
    const auto text = parse_arguments(app, argc, argv);
    if (!text) return report("pathscope-server", text.error());
    if (*text) {
        std::fputs((*text)->c_str(), stdout);
        return 0;
    }
    if (!key_file.empty()) {
        const auto keys = read_secret_key_file(key_file);
        if (!keys) return report("pathscope-server", keys.error());
        const auto listener = public_key_of(client_key);
        if (!listener) return report("pathscope-server", listener.error());
        config.security = Dialler{*keys, *listener};
    }
    config.mesh_cache = mesh_cache_of(mesh_cache, config.cache_folder);
    if (quiet)
        set_log_sink([](LogLevel level, std::string_view sentence) {
            if (level == LogLevel::warning)
                std::fprintf(stderr, "warning: %.*s\n", int(sentence.size()), sentence.data());
        });

    if (ghosts.count == 0) return run(ServerSession::create(config));
    ghosts.host = config.host;
    ghosts.ports = config.ports;
    if (!config.name.empty()) ghosts.name = config.name;
    return run(GhostHost::create(ghosts));
}
