#include "options.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "../common/arguments.hpp"
#include "pathscope/net/security.hpp"
#include "pathscope/session/door.hpp"
#include "pathscope/session/scene_cache.hpp"

namespace pathscope {
namespace {

/// Of the rounds of servers that somebody else started: it costs as much of their time. Local ones are this very build, on
/// this very machine.
constexpr double k_audit_of_strangers = 0.02;

void add_image_options(CLI::App& app, RenderOptions& options) {
    app.add_option("SCENE", options.scene, "a scene file (.json), or a bare .obj")->required();
    app.add_option("-o,--output", options.outputs, "an .exr (layers), .png or .pfm; may be given again")
        ->required()
        ->allow_extra_args(false)
        ->type_name("FILE");
    app.add_option("--camera", options.camera, "one of the scene's cameras, by name (the first)")
        ->type_name("NAME");
    add_size(app, options.size, "pixels");
    const CLI::Range samples(1, int(k_max_samples_per_pixel));
    app.add_option("--spp", options.spp, "indirect samples per pixel (16)")->check(samples)->type_name("N");
    app.add_option("--direct-spp", options.direct_spp, "direct samples per pixel (as --spp)")
        ->check(samples)
        ->type_name("N");
    app.add_option_function<std::string>(
           "--adaptive", [&](const std::string& word) { options.client.sampling.adaptive = word == "on"; },
           "samples where the error is; --spp is the mean (off)")
        ->check(CLI::IsMember({"on", "off"}))
        ->type_name("on|off");
    app.add_option("--target-error", options.client.sampling.target_error,
                   "stop at this estimated relative error; --spp is the most (none)")
        ->check(CLI::Range(1e-6, 1e6))
        ->type_name("E");
    app.add_option_function<double>(
           "--seconds", [&](double seconds) { options.client.time_limit = from_seconds(seconds); },
           "stop after this time instead")
        ->check(CLI::Range(0.001, 1e7))
        ->type_name("T");
    app.add_option("--bounces", options.bounces, "longest path, in bounces; 0 = no limit (0)")
        ->check(CLI::Range(0, 1'000'000))
        ->type_name("N");
    app.add_option("--seed", options.settings.seed, "of the random numbers (1)")->type_name("N");
    app.add_option("--exposure", options.exposure_ev, "of a .png, in stops (the scene's)")
        ->check(CLI::Range(-50.0, 50.0))
        ->type_name("EV");
    app.add_option("--buffers", options.buffers, "further layers of an .exr")
        ->delimiter(',')
        ->check(CLI::IsMember(std::vector<std::string>(k_buffer_names.begin(), k_buffer_names.end())))
        ->type_name("A,B,C");
    const auto direct = app.add_flag("--direct-only", options.direct_only, "leave indirect light out");
    app.add_flag("--indirect-only", options.indirect_only, "leave direct light out")->excludes(direct);
}

void add_levers(CLI::App& app, RenderOptions& options) {
    TransportSettings& transport = options.settings.transport;
    add_lever(app, "--light", transport.light, "how a light is picked");
    app.add_option("--light-samples", transport.light_samples,
                   "light samples per vertex (0 = two, or one where one light is to pick; textbook 1)")
        ->check(CLI::Range(k_auto_light_samples, k_max_light_samples))
        ->type_name("N");
    add_lever(app, "--hemisphere", transport.hemisphere, "how the next direction is drawn");
    add_lever(app, "--mis", transport.mis, "how light and BRDF samples are weighed");
    add_lever(app, "--roulette", transport.roulette.kind, "when a path ends");
    add_lever(app, "--sampler", transport.sampler, "where random numbers come from");
    add_lever(app, "--material", options.scene_options.material, "how materials are taken");
    app.add_option_function<std::string>(
           "--smoothing", [&](const std::string& word) { options.scene_options.smoothing = word == "on"; },
           "normals where the OBJ gives none: smooth within smoothing groups, or flat (on)")
        ->check(CLI::IsMember({"on", "off"}))
        ->type_name("on|off");
    add_lever(app, "--texel-space", options.scene_options.texel_space,
              "in what colour textures are interpolated");
    add_lever(app, "--filter", options.settings.filter, "where indirect light is filtered");
    add_lever(app, "--filter-kind", options.settings.filter_kind, "by which filter");
    app.add_option("--filter-radius", options.settings.bilateral.radius,
                   fmt::format("of the joint filter, in pixels ({})", options.settings.bilateral.radius))
        ->check(CLI::Range(0, k_max_filter_radius))
        ->type_name("N");
    app.add_option("--filter-levels", options.settings.atrous.levels,
                   fmt::format("of the a-trous filter, which sees twice as far with each ({})",
                               options.settings.atrous.levels))
        ->check(CLI::Range(0, k_max_atrous_levels))
        ->type_name("N");
    add_lever(app, "--wire", options.settings.wire,
              "in what form light comes from servers; only exact keeps every bit");
}

void add_cluster_options(CLI::App& app, RenderOptions& options) {
    ClientConfig& client = options.client;
    app.add_option("--servers", client.local_servers, "local servers to start; 0 = render here (0)")
        ->check(CLI::Range(0, 256))
        ->type_name("N");
    app.add_option_function<std::string>(
           "--listen",
           [&](const std::string& address) {
               client.listens = true;
               client.host = address;
           },
           "wait for servers at this address")
        ->type_name("ADDR");
    app.add_option("--min-servers", client.min_servers, "begin when so many are ready (1 with --listen)")
        ->check(CLI::Range(0, 4096))
        ->type_name("N");
    app.add_flag("--relaxed", client.relaxed,
                 "admit servers whose bits may differ; the image is marked as not reproducible");
    add_ports(app, client.ports);
    add_lever(app, "--strategy", client.strategy,
              "what servers compute: indirect light, or arithmetic, to test servers with");
    add_lever(app, "--schedule", client.schedule, "who renders which block");
    add_lever(app, "--detector", client.detector, "when a silent server counts as dead");
    app.add_option("--audit", client.audit.share,
                   "share of rounds that are rendered twice and compared (0.02 with --listen, else 0)")
        ->check(CLI::Range(0.0, 1.0))
        ->type_name("SHARE");
    add_lever(app, "--order", client.order, "which blocks come first");
    app.add_option("--block", client.block_size, "pixels along a block's side (32)")
        ->check(CLI::Range(1, k_max_block_size))
        ->type_name("N");
    app.add_option("--round", client.round_samples, "samples per pixel in one round (4)")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    app.add_option_function<double>(
           "--lease-ms", [&](double ms) { client.lease_time = from_seconds(ms / 1000); },
           fmt::format("work in one lease, while there is enough; 0 = one round each ({:g})",
                       to_seconds(client.lease_time) * 1000))
        ->check(CLI::Range(0.0, 60'000.0))
        ->type_name("MS");
    add_lever(app, "--bvh", client.tree, "which tree finds hits");
    app.add_option("--threads", client.threads, "of the client's own rendering; 0 = all cores (0)")
        ->check(CLI::Range(0, 1024))
        ->type_name("N");
    add_mesh_cache(app, client.local_server_mesh_cache);
    app.add_option("--stats", options.stats, "write figures of the run as JSON")->type_name("FILE");
    const auto metrics =
        app.add_option("--metrics", options.metrics,
                       "answer http://ADDR:PORT/metrics, for Prometheus; port 0 = a free one")
            ->type_name("ADDR:PORT");
    app.add_flag("--metrics-public", options.metrics_public,
                 "of --metrics: other machines may read it, without keys")
        ->needs(metrics);
    app.add_option("--trace", options.trace, "write a time line for ui.perfetto.dev")->type_name("FILE");
}

void add_checkpoint_options(CLI::App& app, RenderOptions& options) {
    CheckpointOptions& checkpoint = options.checkpoint;
    const auto write =
        app.add_option("--checkpoint", checkpoint.write, "write what is rendered so far to this new file")
            ->type_name("FILE");
    const auto resume =
        app.add_option("--resume", checkpoint.resume, "go on from this checkpoint")->type_name("FILE");
    app.add_option_function<std::string>(
           "--continue",
           [&](const std::string& file) {
               checkpoint.write = checkpoint.resume = file;
               checkpoint.resume_if_there = true;
           },
           "--checkpoint FILE, and --resume FILE if it is there")
        ->excludes(write)
        ->excludes(resume)
        ->type_name("FILE");
    app.add_option_function<double>(
           "--checkpoint-every", [&](double seconds) { checkpoint.every = from_seconds(seconds); },
           fmt::format("between two checkpoints ({:g})", to_seconds(checkpoint.every)))
        ->check(CLI::Range(0.01, 1e6))
        ->type_name("SECONDS");
}

/// What was said about keys on the command line.
struct KeyOptions {
    std::filesystem::path key, allow;
};

void add_key_options(CLI::App& app, RenderOptions& options, KeyOptions& keys) {
    const auto key = app.add_option("--key", keys.key,
                                    "this client's secret key, as --keygen writes it; servers need keys then")
                         ->type_name("FILE");
    app.add_option("--allow", keys.allow,
                   "public keys of the servers that may come in, one a line; read again when it changes")
        ->needs(key)
        ->type_name("FILE");
    app.add_flag("--insecure", options.client.insecure,
                 "listen on other addresses than this machine's own, without keys");
    add_keygen(app);
}

/// Keys, or an address where none are needed, or the user's word.
Result<void> check_keys(RenderOptions& options, const KeyOptions& keys) {
    ClientConfig& client = options.client;
    if (!keys.key.empty()) {
        if (client.listens && keys.allow.empty())
            return bad_input(
                "--listen with --key needs --allow FILE: the public keys of the servers that may come in.");
        const auto pair = read_secret_key_file(keys.key);
        if (!pair) return pair.error();
        client.keys = ClientKeys{*pair, keys.allow};
        if (!keys.allow.empty())
            if (const auto list = AllowList::open(keys.allow); !list) return list.error();
    }
    return client.listens ? check_listening(client) : Result<void>();
}

/// Figures are for this machine's eyes, unless the user says otherwise.
Result<void> check_metrics(const RenderOptions& options) {
    if (!options.metrics || options.metrics_public || !reaches_other_machines("tcp://" + *options.metrics))
        return {};
    return bad_input(fmt::format(
        "--metrics {}: other machines could read this address. Use 127.0.0.1:PORT, or add --metrics-public.",
        *options.metrics));
}

/// `flat` is no light: nothing of it may get where a picture goes on from, or be judged as noise.
Result<void> check_strategy(const RenderOptions& options) {
    if (options.client.strategy == Strategy::blocks) return {};
    const char* const other = options.client.sampling.adaptive                        ? "--adaptive on"
                              : options.client.sampling.target_error > 0              ? "--target-error"
                              : options.checkpoint.write || options.checkpoint.resume ? "a checkpoint"
                              : options.settings.wire != WireFormat::exact            ? "--wire"
                                                                                      : nullptr;
    if (!other) return {};
    return bad_input(fmt::format("--strategy {}: it does not go together with {}.",
                                 name_of(options.client.strategy), other));
}

/// What --adaptive and --target-error need of other flags.
Result<void> check_sampling(const RenderOptions& options) {
    const ClientConfig& client = options.client;
    if (!client.sampling.staged()) return {};
    const char* flag = client.sampling.adaptive ? "--adaptive on" : "--target-error";
    if (options.settings.filter == FilterPlace::server)
        return bad_input(
            fmt::format("{}: with --filter server tiles come filtered, and noise cannot be measured. Use "
                        "--filter client.",
                        flag));
    return {};
}

}  // namespace

Result<std::variant<RenderOptions, std::string>> parse_options(int argc, const char* const* argv) {
    RenderOptions options;
    KeyOptions keys;
    CLI::App app("Renders a scene to an image, alone or with render servers.", "pathscope-render");

    // The setting comes first whatever its place on the command line: single levers are pulled on top of it.
    Setting setting = Setting::best;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        const std::string value = word.rfind("--setting=", 0) == 0      ? word.substr(10)
                                  : word == "--setting" && i + 1 < argc ? argv[i + 1]
                                                                        : "";
        if (const auto named = from_name<Setting>(value)) setting = *named;
    }
    options.settings.transport = make_settings(setting);

    add_image_options(app, options);
    add_lever(app, "--setting", setting, "all levers at once");
    add_levers(app, options);
    add_checkpoint_options(app, options);
    add_cluster_options(app, options);
    add_key_options(app, options, keys);

    auto text = parse_arguments(app, argc, argv);
    if (!text) return text.error();
    if (*text) return std::variant<RenderOptions, std::string>(**text);

    options.mesh_cache = mesh_cache_of(options.client.local_server_mesh_cache, SceneCache::default_folder());
    if (const auto fits = check_sampling(options); !fits) return fits.error();
    if (const auto fits = check_strategy(options); !fits) return fits.error();
    if (const auto fits = check_metrics(options); !fits) return fits.error();
    if (app.count("--checkpoint-every") > 0 && !options.checkpoint.write)
        return bad_input("--checkpoint-every: no checkpoint is written; add --checkpoint or --continue.");
    options.client.ports_were_chosen = app.count("--ports") > 0;
    if (const auto safe = check_keys(options, keys); !safe) return safe.error();
    if (options.client.listens && app.count("--min-servers") == 0) options.client.min_servers = 1;
    if (options.client.listens && app.count("--audit") == 0)
        options.client.audit.share = k_audit_of_strangers;
    return std::variant<RenderOptions, std::string>(std::move(options));
}

}  // namespace pathscope
