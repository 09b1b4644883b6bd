#include "options.hpp"

#include "../common/arguments.hpp"

namespace pathscope {
namespace {

struct KeyOptions {
    std::string own, of_client;
};

void add_server_options(CLI::App& app, ServerConfig& config, std::string& mesh_cache) {
    app.add_option("--connect", config.host, "host of the client (127.0.0.1)")->type_name("HOST");
    add_ports(app, config.ports);
    app.add_option("--threads", config.threads, "threads that render; 0 = all cores (0)")
        ->check(CLI::Range(0, 1024))
        ->type_name("N");
    add_lever(app, "--bvh", config.tree, "which tree finds hits");
    app.add_option("--speed-cap", config.samples_per_second,
                   "render no faster, in samples per second; 0 = no cap (0)")
        ->check(CLI::Range(0.0, 1e12))
        ->type_name("N");
    add_name(app, config.name);
    app.add_option("--cache", config.cache_folder, "folder for scene files, by content; safe to delete")
        ->type_name("DIR");
    add_mesh_cache(app, mesh_cache);
}

void add_key_options(CLI::App& app, KeyOptions& keys) {
    const auto own = app.add_option("--key", keys.own, "this server's secret key, as --keygen writes it")
                         ->type_name("FILE");
    const auto of_client =
        app.add_option("--server-key", keys.of_client, "the client's public key, or its .pub file")
            ->type_name("KEY");
    own->needs(of_client);
    of_client->needs(own);
    add_keygen(app);
}

void add_ghost_options(CLI::App& app, GhostConfig& ghosts) {
    CLI::Option* const ghost =
        app.add_option("--ghost", ghosts.count,
                       "be N servers that render nothing and answer with noise in a modelled time: for "
                       "measuring the client; 0 = a real server (0)")
            ->check(CLI::Range(1, GhostHost::k_most_ghosts))
            ->excludes(app.get_option("--threads"))
            ->excludes(app.get_option("--speed-cap"))
            ->type_name("N");
    const auto assign = [&ghosts](const std::string& text) {
        const auto speed = parse_ghost_speed(text);
        if (!speed) throw CLI::ValidationError("--ghost-speed", speed.error().message);
        ghosts.speed = *speed;
    };
    app.add_option_function<std::string>(
           "--ghost-speed", assign,
           "of each ghost, all alike or lognormal around that median (" + to_text(ghosts.speed) + ")")
        ->needs(ghost)
        ->type_name("SAMPLES_PER_S[,lognormal:SIGMA]");
    app.add_option("--ghost-seed", ghosts.seed, "of the ghosts' speeds (1)")->needs(ghost)->type_name("N");
}

Result<void> read_keys(const KeyOptions& keys, ServerConfig& config) {
    if (keys.own.empty()) return {};
    const auto pair = read_secret_key_file(keys.own);
    if (!pair) return pair.error();
    const auto listener = public_key_of(keys.of_client);
    if (!listener) return listener.error();
    config.security = Dialler{*pair, *listener};
    return {};
}

}  // namespace

Result<std::variant<ServerOptions, std::string>> parse_options(int argc, const char* const* argv) {
    ServerOptions options;
    options.ghosts.count = 0;
    options.server.cache_folder = SceneCache::default_folder();
    std::string mesh_cache;
    KeyOptions keys;
    CLI::App app("Renders indirect light for a client; goes on trying until told to stop (Ctrl+C).",
                 "pathscope-server");
    add_server_options(app, options.server, mesh_cache);
    add_key_options(app, keys);
    add_ghost_options(app, options.ghosts);
    app.add_flag("--quiet", options.quiet, "say only what is wrong");

    auto text = parse_arguments(app, argc, argv);
    if (!text) return text.error();
    if (*text) return std::variant<ServerOptions, std::string>(**text);

    if (const auto read = read_keys(keys, options.server); !read) return read.error();
    options.server.mesh_cache = mesh_cache_of(mesh_cache, options.server.cache_folder);
    options.ghosts.host = options.server.host;
    options.ghosts.ports = options.server.ports;
    if (!options.server.name.empty()) options.ghosts.name = options.server.name;
    return std::variant<ServerOptions, std::string>(std::move(options));
}

}  // namespace pathscope
