#include "run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <tuple>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/core/parallel_for.hpp"
#include "pathscope/image/image_hash.hpp"
#include "pathscope/image/io.hpp"
#include "pathscope/probe/trace_export.hpp"
#include "pathscope/render/rendered_frame.hpp"
#include "pathscope/sampling/sampler.hpp"
#include "pathscope/session/client_session.hpp"
#include "pathscope/session/stats.hpp"
#include "render_loop.hpp"

namespace pathscope {
namespace {

constexpr std::uint32_t k_default_spp = 16;
constexpr int k_default_width = 640;

/// Everything that can be refused is refused before the scene is loaded.
Result<void> check_outputs(const RenderOptions& options) {
    for (const auto& output : options.outputs)
        if (const auto ok = check_writable(output); !ok) return ok;
    for (const auto& file : {options.stats, options.trace})
        if (file)
            if (const auto ok = write_file_atomically(*file, ""); !ok) return ok;
    return {};
}

Result<CameraSpec> choose_camera(const SceneFile& scene, const std::string& name) {
    if (name.empty()) return scene.cameras.front();
    if (const CameraSpec* camera = find_camera(scene, name)) return *camera;
    std::string names;
    for (const CameraSpec& camera : scene.cameras) names += (names.empty() ? "" : ", ") + camera.name;
    return bad_input(
        fmt::format("--camera {}: the scene has no camera of that name; it has {}.", name, names));
}

std::pair<int, int> choose_size(const RenderOptions& options, const SceneFile& scene,
                                const CameraSpec& camera) {
    if (options.size) return *options.size;
    if (const auto& size = scene.defaults.size) return {size->width, size->height};
    const Aspect aspect = camera.aspect.value_or(Aspect{});
    return {k_default_width, std::max(1, k_default_width * aspect.height / aspect.width)};
}

/// What the command line left open, the scene decides.
Result<RenderState> make_state(const RenderOptions& options, const SceneFile& file, const Scene& scene) {
    const Result<CameraSpec> camera = choose_camera(file, options.camera);
    if (!camera) return camera.error();
    RenderState state;
    state.scene = file;
    state.options = options.scene_options;
    state.camera = camera->view;
    state.settings = options.settings;
    RenderSettings& settings = state.settings;
    std::tie(settings.width, settings.height) = choose_size(options, file, *camera);
    const std::uint32_t default_spp = options.client.time_limit > 0 ? k_max_samples_per_pixel
                                      : file.defaults.spp           ? std::uint32_t(*file.defaults.spp)
                                                                    : k_default_spp;
    settings.spp = options.spp.value_or(default_spp);
    settings.direct_spp = options.direct_spp.value_or(settings.spp);
    settings.transport.max_bounces = options.bounces.value_or(file.defaults.bounces.value_or(0));
    if (options.direct_only) settings.spp = 0;
    if (options.indirect_only) settings.direct_spp = 0;
    settings.quantum = quantum_for(scene.typical_radiance, scene.brightest_radiance);
    return state;
}

/// A budget that passes cannot be made of is refused with the numbers that it would need.
Result<void> check_budget(const ClientConfig& client, const RenderSettings& settings) {
    if (!client.sampling.staged()) return {};
    const std::uint32_t least = least_staged_budget(client.round_samples);
    for (const auto& [flag, samples] :
         {std::pair("--spp", settings.spp), std::pair("--direct-spp", settings.direct_spp)}) {
        if (samples > 0 && samples < least)
            return bad_input(
                fmt::format("{} {}: --adaptive on and --target-error need at least {} with --round {}: a "
                            "round, and the samples that measure noise.",
                            flag, samples, least, client.round_samples));
        if (samples > k_sequence_samples && client.time_limit == 0)
            return bad_input(fmt::format("{} {}: --adaptive on and --target-error take at most {}.", flag,
                                         samples, k_sequence_samples));
    }
    return {};
}

/// The layers of an .exr; the first is what .png and .pfm hold. Pictures live as long as `buffers`.
struct Buffers {
    RenderedFrame frame;
    Guides guides;
    Plane samples;
};
std::vector<ImageLayer> make_layers(const Buffers& buffers, const std::vector<std::string>& names) {
    std::vector<ImageLayer> layers{{"combined", &buffers.frame.combined}};
    for (const std::string& name : names) {
        if (name == "direct") layers.push_back({name, &buffers.frame.direct});
        if (name == "indirect") layers.push_back({name, &buffers.frame.indirect});
        if (name == "unfiltered") layers.push_back({name, &buffers.frame.unfiltered});
        if (name == "albedo") layers.push_back({name, &buffers.guides.albedo});
        if (name == "normal") layers.push_back({name, &buffers.guides.normal});
        if (name == "depth") layers.push_back({"depth.Z", &buffers.guides.depth});
        if (name == "spp") layers.push_back({name, &buffers.samples});
    }
    return layers;
}

bool needs_guides(const RenderState& state, const std::vector<std::string>& buffers) {
    return state.settings.filter == FilterPlace::client ||
           std::any_of(buffers.begin(), buffers.end(), [](const auto& name) {
               return name == "albedo" || name == "normal" || name == "depth";
           });
}

ClientConfig complete_config(const RenderOptions& options) {
    ClientConfig config = options.client;
    config.server_program = program_folder() / "pathscope-server";
    if (config.local_servers > 0)
        config.local_server_threads = std::max(1, hardware_threads() / config.local_servers);
    return config;
}

/// Nothing if it was not asked for.
Result<std::unique_ptr<MetricsEndpoint>> open_metrics(const RenderOptions& options, const EventStore& store) {
    if (!options.metrics) return std::unique_ptr<MetricsEndpoint>();
    auto endpoint = MetricsEndpoint::open(*options.metrics, store);
    if (!endpoint) return bad_input("--metrics: " + endpoint.error().message);
    log_note(fmt::format("Metrics are at http://{}:{}/metrics.",
                         options.metrics->substr(0, options.metrics->rfind(':')), (*endpoint)->port()));
    return endpoint;
}

void tell_how_to_join(const std::string& endpoint, const std::optional<ClientKeys>& keys) {
    log_note(fmt::format("Waiting for servers at {}; start them with: pathscope-server --connect HOST{}",
                         endpoint,
                         keys ? fmt::format(" --key FILE --server-key '{}'", keys->pair.public_key) : ""));
}

/// Why another run may give other bits; empty if it may not.
std::string why_not_reproducible(std::uint64_t differing_rounds, WireFormat wire, const FrameWork& work) {
    std::string why;
    if (differing_rounds > 0)
        why = fmt::format(
            "{} of {} rounds came from servers whose bits may differ from the client's (--relaxed).",
            differing_rounds, work.indirect_ledger().rounds_committed());
    if (wire != WireFormat::exact)
        why +=
            fmt::format("{}Light lost bits on its way (--wire {}).", why.empty() ? "" : " ", name_of(wire));
    return why;
}

}  // namespace

Result<void> run_render(const RenderOptions& options, const std::atomic<bool>& interrupted) {
    const TimeNs begin = monotonic_now();
    if (const auto ok = check_outputs(options); !ok) return ok;
    Result<std::optional<CheckpointFile>> resume = open_checkpoint(options.checkpoint);
    if (!resume) return resume.error();
    RunFigures figures;
    if (*resume) figures.resumed = (*resume)->history();

    Result<OpenedScene> opened = open_scene(options.scene, options.scene_options, options.mesh_cache);
    if (!opened) return opened.error();
    const TimeNs loaded = monotonic_now();
    Result<Scene> scene =
        make_scene(opened->file, std::move(opened->parts), {options.client.threads, options.client.tree});
    if (!scene) return scene.error();
    const TimeNs built = monotonic_now();
    const Result<RenderState> state = make_state(options, opened->file, *scene);
    if (!state) return state.error();
    if (const auto fits = check_budget(options.client, state->settings); !fits) return fits;

    EventStore store(options.trace ? ProbeLevel::full : ProbeLevel::counters);
    const auto metrics = open_metrics(options, store);
    if (!metrics) return metrics.error();
    const auto shared_scene = std::make_shared<const Scene>(std::move(*scene));
    auto session =
        ClientSession::create(complete_config(options),
                              {*state, shared_scene, SceneDepot(*opened->files), std::move(*resume)}, store);
    if (!session) return session.error();
    const WorkHistory earlier = figures.resumed.value_or(WorkHistory{});
    if ((*session)->progress().waiting) tell_how_to_join((*session)->endpoints()[1], options.client.keys);
    RenderLoop loop(**session, store, options.checkpoint, earlier, built);
    if (*metrics) loop.publish_to(**metrics);
    if (const auto done = loop.run(interrupted); !done) return done;
    const TimeNs rendered = monotonic_now();

    // The picture, and what was asked for beside it.
    const FrameWork& work = (*session)->work();
    const RenderSettings& settings = state->settings;
    Buffers buffers;
    if (needs_guides(*state, options.buffers))
        buffers.guides = render_guides(*shared_scene, state->camera, settings,
                                       {0, 0, settings.width, settings.height}, options.client.threads);
    buffers.frame =
        compose_frame(work.direct(), work.indirect(), settings, buffers.guides, options.client.threads);
    buffers.samples = settings.spp > 0 ? work.indirect().samples() : work.direct().samples();
    SaveOptions save;
    save.tone_map.exposure_ev = options.exposure_ev.value_or(opened->file.exposure_ev);
    const std::string why = why_not_reproducible((*session)->differing_rounds(), settings.wire, work);
    figures.reproducible = why.empty();
    if (!figures.reproducible) {
        log_warning("The image is not reproducible: " + why);
        save.metadata.emplace("not_reproducible", why);
    }
    const std::vector<ImageLayer> layers = make_layers(buffers, options.buffers);
    for (const auto& output : options.outputs)
        if (const auto saved = save_image(output, layers, save); !saved) return saved;

    figures.load_s = to_seconds(loaded - begin);
    figures.build_s = to_seconds(built - loaded);
    figures.render_s = earlier.render_s + to_seconds(rendered - built);
    figures.threads = options.client.threads > 0 ? options.client.threads : hardware_threads();
    figures.strategy = options.client.strategy;
    figures.memory = memory_of(*shared_scene);
    figures.image_hash = image_hash(buffers.frame.combined);
    figures.estimated_error = work.estimated_error();
    figures.samples_per_pixel = summary_of(buffers.samples);
    figures.saturated = (*session)->saturated();
    figures.dropped = (*session)->dropped();
    session->reset();  // Ends the local servers.
    if (options.trace)
        if (const auto written = write_trace(store, *options.trace); !written) return written;
    figures.wall_s = to_seconds(monotonic_now() - begin);
    if (options.stats) return write_file_atomically(*options.stats, stats_json(*state, store, figures));
    return {};
}

}  // namespace pathscope
