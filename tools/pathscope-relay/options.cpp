#include "options.hpp"

#include "../common/arguments.hpp"

namespace pathscope {
namespace {

struct KeyOptions {
    std::filesystem::path own, allow;
    std::string of_client;
};

void add_options_above(CLI::App& app, RelayConfig& config) {
    app.add_option("--connect", config.client.host, "host of the client (127.0.0.1)")->type_name("HOST");
    add_ports(app, config.client.ports);
    add_name(app, config.client.name);
    app.add_option("--cache", config.cache_folder,
                   "folder for scene files, by content; safe to delete while no relay runs on it")
        ->type_name("DIR");
}

void add_options_below(CLI::App& app, ClientConfig& config) {
    app.add_option("--listen", config.host, "wait for servers at this address (127.0.0.1)")
        ->type_name("ADDR");
    add_ports(app, config.ports, "--listen-ports", "for servers: ");
    add_lever(app, "--detector", config.detector, "when a silent server counts as lost");
}

void add_key_options(CLI::App& app, KeyOptions& keys, ClientConfig& config) {
    CLI::Option* const own =
        app.add_option("--key", keys.own,
                       "this relay's secret key, as --keygen writes it, towards client and servers")
            ->type_name("FILE");
    app.add_option("--server-key", keys.of_client,
                   "the client's public key, or its .pub file; without it the client has no keys")
        ->needs(own)
        ->type_name("KEY");
    app.add_option("--allow", keys.allow,
                   "public keys of the servers that may come in, one a line; read again when it changes")
        ->needs(own)
        ->type_name("FILE");
    app.add_flag("--insecure", config.insecure,
                 "listen on other addresses than this machine's own, without keys");
    add_keygen(app);
}

/// Keys for either side, or an address where none are needed, or the user's word.
Result<void> read_keys(const KeyOptions& keys, RelayConfig& config) {
    if (keys.own.empty()) return check_listening(config.below);
    if (keys.of_client.empty() && keys.allow.empty())
        return bad_input("--key needs --server-key KEY, --allow FILE, or both.");
    const auto pair = read_secret_key_file(keys.own);
    if (!pair) return pair.error();
    if (!keys.of_client.empty()) {
        const auto listener = public_key_of(keys.of_client);
        if (!listener) return listener.error();
        config.client.security = Dialler{*pair, *listener};
    }
    if (!keys.allow.empty()) {
        if (const auto list = AllowList::open(keys.allow); !list) return list.error();
        config.below.keys = ClientKeys{*pair, keys.allow};
    }
    return check_listening(config.below);
}

}  // namespace

Result<std::variant<RelayOptions, std::string>> parse_options(int argc, const char* const* argv) {
    RelayOptions options;
    options.relay.cache_folder = SceneCache::default_folder();
    options.relay.below.ports = k_default_relay_ports;
    KeyOptions keys;
    CLI::App app(
        "Stands for its servers towards a client, which has one peer in place of many; goes on until told to "
        "stop (Ctrl+C).",
        "pathscope-relay");
    add_options_above(app, options.relay);
    add_options_below(app, options.relay.below);
    add_key_options(app, keys, options.relay.below);
    app.add_flag("--quiet", options.quiet, "say only what is wrong");

    auto text = parse_arguments(app, argc, argv);
    if (!text) return text.error();
    if (*text) return std::variant<RelayOptions, std::string>(**text);
    if (const auto read = read_keys(keys, options.relay); !read) return read.error();
    return std::variant<RelayOptions, std::string>(std::move(options));
}

}  // namespace pathscope
