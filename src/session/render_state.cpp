#include "pathscope/session/render_state.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "pathscope/wire/field_reader.hpp"

namespace pathscope {
namespace {

constexpr std::array<std::string_view, 20> k_keys{
    "scene",   "files",      "material", "smoothing", "texel_space",   "camera",     "size",
    "spp",     "direct_spp", "seed",     "light",     "light_samples", "hemisphere", "mis",
    "sampler", "roulette",   "bounces",  "filter",    "quantum",       "wire"};
constexpr std::array<std::string_view, 4> k_filter_keys{"place", "kind", "joint", "atrous"};

PackValue pack_vec(Vec3 v) { return PackArray{double(v.x), double(v.y), double(v.z)}; }

Vec3 read_vec(FieldReader& fields, std::string_view name) {
    const PackArray& array = fields.array(name, 3);
    Vec3 v;
    if (array.size() != 3) fields.fail(name, "must be three numbers");
    for (int axis = 0; axis < 3 && !fields.error(); ++axis) {
        const double* number = array[std::size_t(axis)].get<double>();
        if (!number || !std::isfinite(float(*number)))
            fields.fail(name, "must be three finite floats");
        else
            v[axis] = float(*number);
    }
    return v;
}

float read_float(FieldReader& fields, std::string_view name, float least, float most) {
    return float(fields.f64(name, least, most));
}

PackMap encode_camera(const Camera& camera) {
    PackMap map;
    map.set("position", pack_vec(camera.position));
    map.set("look_at", pack_vec(camera.look_at));
    map.set("up", pack_vec(camera.up));
    map.set("vfov_deg", double(camera.vfov_deg));
    return map;
}

Camera decode_camera(FieldReader& state) {
    FieldReader fields(state.map("camera"), "camera");
    Camera camera;
    camera.position = read_vec(fields, "position");
    camera.look_at = read_vec(fields, "look_at");
    camera.up = read_vec(fields, "up");
    camera.vfov_deg = read_float(fields, "vfov_deg", 0, 180);
    if (fields.error()) {
        state.fail("camera", "is wrong: " + fields.error()->message);
        return {};
    }
    if (const auto ok = check_camera(camera); !ok) state.fail("camera", "is wrong: " + ok.error().message);
    return camera;
}

PackMap encode_roulette(const RouletteParams& params) {
    PackMap map;
    map.set("kind", name_of(params.kind));
    map.set("first_bounce", params.first_bounce);
    map.set("constant_survival", double(params.constant_survival));
    map.set("max_survival", double(params.max_survival));
    return map;
}

RouletteParams decode_roulette(FieldReader& state) {
    FieldReader fields(state.map("roulette"), "roulette");
    RouletteParams params;
    params.kind = fields.enumerator<Roulette>("kind");
    params.first_bounce = int(fields.u32("first_bounce", 0, 1'000'000));
    params.constant_survival = read_float(fields, "constant_survival", 0.01f, 1);
    params.max_survival = read_float(fields, "max_survival", 0.01f, 1);
    if (fields.error()) state.fail("roulette", "is wrong: " + fields.error()->message);
    return params;
}

/// A sigma of 0 stands for infinity: MessagePack headers carry finite numbers only.
double finite_sigma(float sigma) { return std::isinf(sigma) ? 0.0 : double(sigma); }

/// What both filters have: the sigmas of the guides.
template <class Params>
void encode_guide_use(PackMap& map, const Params& params) {
    map.set("sigma_normal", finite_sigma(params.sigma_normal));
    map.set("sigma_depth", finite_sigma(params.sigma_depth));
    map.set("sigma_albedo", finite_sigma(params.sigma_albedo));
    map.set("demodulate_albedo", params.demodulate_albedo);
}

PackMap encode_joint(const BilateralParams& params) {
    PackMap map;
    map.set("radius", params.radius);
    map.set("sigma_spatial", finite_sigma(params.sigma_spatial));
    encode_guide_use(map, params);
    return map;
}

PackMap encode_atrous(const AtrousParams& params) {
    PackMap map;
    map.set("levels", params.levels);
    map.set("sigma_colour", finite_sigma(params.sigma_colour));
    encode_guide_use(map, params);
    return map;
}

PackMap encode_filter(const RenderSettings& settings) {
    PackMap map;
    map.set("place", name_of(settings.filter));
    map.set("kind", name_of(settings.filter_kind));
    map.set("joint", encode_joint(settings.bilateral));
    map.set("atrous", encode_atrous(settings.atrous));
    return map;
}

float read_sigma(FieldReader& fields, std::string_view name) {
    const float value = read_float(fields, name, 0, 1e9f);
    return value == 0 ? k_infinity : value;
}

/// The map `name` of the filter: `read_own` reads what this kind alone has.
template <class Params, class ReadOwn>
void decode_params(FieldReader& filter, const char* name, Params& params, ReadOwn&& read_own) {
    FieldReader fields(filter.map(name), name);
    read_own(fields);
    params.sigma_normal = read_sigma(fields, "sigma_normal");
    params.sigma_depth = read_sigma(fields, "sigma_depth");
    params.sigma_albedo = read_sigma(fields, "sigma_albedo");
    params.demodulate_albedo = fields.boolean("demodulate_albedo");
    if (fields.error()) return filter.fail(name, "is wrong: " + fields.error()->message);
    if (const auto ok = check_params(params); !ok) filter.fail(name, "is wrong: " + ok.error().message);
}

void decode_filter(FieldReader& state, RenderSettings& settings) {
    FieldReader fields(state.map("filter"), "filter");
    fields.only(k_filter_keys);
    settings.filter = fields.enumerator<FilterPlace>("place");
    settings.filter_kind = fields.enumerator<FilterKind>("kind");
    decode_params(fields, "joint", settings.bilateral, [&](FieldReader& joint) {
        settings.bilateral.radius = int(joint.u32("radius", 0, k_max_filter_radius));
        settings.bilateral.sigma_spatial = read_sigma(joint, "sigma_spatial");
    });
    decode_params(fields, "atrous", settings.atrous, [&](FieldReader& wavelet) {
        settings.atrous.levels = int(wavelet.u32("levels", 0, k_max_atrous_levels));
        settings.atrous.sigma_colour = read_sigma(wavelet, "sigma_colour");
    });
    if (fields.error()) state.fail("filter", "is wrong: " + fields.error()->message);
}

void decode_size(FieldReader& state, RenderSettings& settings) {
    const PackArray& size = state.array("size", 2);
    const auto side = [&](std::size_t i) {
        const std::uint64_t* value = i < size.size() ? size[i].get<std::uint64_t>() : nullptr;
        if (!value || *value < 1 || *value > std::uint64_t(k_max_image_side))
            state.fail("size", fmt::format("must be two integers from 1 to {}", k_max_image_side));
        else
            return int(*value);
        return 1;
    };
    settings.width = side(0);
    settings.height = side(1);
}

SceneFile decode_scene(FieldReader& state) {
    const std::string text(state.text("scene", 2, k_payload_limits.max_bytes));
    if (state.error()) return {};
    Result<SceneFile> scene = parse_scene_file(text, "the client's scene");
    if (scene) return std::move(*scene);
    state.fail("scene", "is wrong: " + scene.error().message);
    return {};
}

Digest decode_digest(FieldReader& fields, std::string_view name) {
    const std::string_view bytes = fields.bytes(name, Digest{}.size(), Digest{}.size());
    Digest digest{};
    if (bytes.size() == digest.size()) std::copy(bytes.begin(), bytes.end(), digest.begin());
    return digest;
}

PackBytes pack_digest(const Digest& digest) { return {std::string(digest.begin(), digest.end())}; }

}  // namespace

PackMap encode_state(const RenderState& state) {
    const RenderSettings& settings = state.settings;
    const TransportSettings& transport = settings.transport;
    PackMap map;
    map.set("scene", to_json(state.scene));
    map.set("files", pack_digest(state.files));
    map.set("material", name_of(state.options.material));
    map.set("smoothing", state.options.smoothing);
    map.set("texel_space", name_of(state.options.texel_space));
    map.set("camera", encode_camera(state.camera));
    map.set("size", PackArray{settings.width, settings.height});
    map.set("spp", settings.spp);
    map.set("direct_spp", settings.direct_spp);
    map.set("seed", settings.seed);
    map.set("light", name_of(transport.light));
    map.set("light_samples", transport.light_samples);
    map.set("hemisphere", name_of(transport.hemisphere));
    map.set("mis", name_of(transport.mis));
    map.set("sampler", name_of(transport.sampler));
    map.set("roulette", encode_roulette(transport.roulette));
    map.set("bounces", transport.max_bounces);
    map.set("filter", encode_filter(settings));
    map.set("quantum", settings.quantum.exponent);
    map.set("wire", name_of(settings.wire));
    return map;
}

Result<RenderState> decode_state(const PackMap& map) {
    FieldReader fields(map, "render state");
    fields.only(k_keys);
    RenderState state;
    RenderSettings& settings = state.settings;
    state.scene = decode_scene(fields);
    state.files = decode_digest(fields, "files");
    state.options.material = fields.enumerator<MaterialModel>("material");
    state.options.smoothing = fields.boolean("smoothing");
    state.options.texel_space = fields.enumerator<TexelSpace>("texel_space");
    state.camera = decode_camera(fields);
    decode_size(fields, settings);
    settings.spp = fields.u32("spp", 0, k_max_samples_per_pixel);
    settings.direct_spp = fields.u32("direct_spp", 0, k_max_samples_per_pixel);
    settings.seed = fields.u32("seed");
    settings.transport.light = fields.enumerator<LightSampling>("light");
    settings.transport.light_samples =
        int(fields.u32("light_samples", k_auto_light_samples, k_max_light_samples));
    settings.transport.hemisphere = fields.enumerator<HemisphereSampling>("hemisphere");
    settings.transport.mis = fields.enumerator<MisHeuristic>("mis");
    settings.transport.sampler = fields.enumerator<SamplerKind>("sampler");
    settings.transport.roulette = decode_roulette(fields);
    settings.transport.max_bounces = int(fields.u32("bounces", 0, 1'000'000));
    decode_filter(fields, settings);
    settings.quantum.exponent = int(fields.i64("quantum", Quantum::k_min_exponent, Quantum::k_max_exponent));
    settings.wire = fields.enumerator<WireFormat>("wire");
    if (fields.error()) return *fields.error();
    return state;
}

Digest state_hash(const RenderState& state) { return hash_text(pack(encode_state(state))); }

PackMap state_changes(const RenderState& before, const RenderState& after) {
    const PackMap old_map = encode_state(before), new_map = encode_state(after);
    PackMap changes;
    for (const auto& [key, value] : new_map.entries())
        if (const PackValue* old_value = old_map.find(key); !old_value || *old_value != value)
            changes.set(key, value);
    return changes;
}

Result<RenderState> apply_changes(const RenderState& state, const PackMap& changes) {
    PackMap map = encode_state(state);
    for (const auto& [key, value] : changes.entries()) map.set(key, value);
    return decode_state(map);
}

bool same_scene(const RenderState& a, const RenderState& b) {
    return a.scene == b.scene && a.files == b.files && a.options == b.options;
}

std::string pack_manifest(const Manifest& manifest) {
    PackArray files, missing;
    for (const ManifestEntry& entry : manifest.files) {
        PackMap file;
        file.set("name", PackBytes{entry.name});  // Bytes: file names need not be UTF-8.
        file.set("size", entry.size);
        file.set("hash", pack_digest(entry.hash));
        files.emplace_back(std::move(file));
    }
    for (const std::string& name : manifest.missing) missing.emplace_back(PackBytes{name});
    PackMap map;
    map.set("files", std::move(files));
    map.set("missing", std::move(missing));
    return pack(map);
}

Result<Manifest> unpack_manifest(std::string_view bytes) {
    const Result<PackValue> value = unpack(bytes, k_payload_limits);
    if (!value) return value.error();
    const PackMap* map = value->get<PackMap>();
    if (!map) return bad_input("The manifest is not a map.");
    FieldReader fields(*map, "manifest");
    Manifest manifest;
    std::uint64_t total = 0;
    for (const PackValue& item : fields.array("files", 1 << 16)) {
        const PackMap* file = item.get<PackMap>();
        if (!file) return bad_input("manifest: field 'files' must hold maps.");
        FieldReader entry(*file, "manifest file");
        const std::string name(entry.bytes("name", 1, 4096));
        const std::uint64_t size = entry.u64("size", 0, k_max_scene_bytes);
        const Digest hash = decode_digest(entry, "hash");
        if (entry.error()) return *entry.error();
        total += size;
        manifest.files.push_back({name, size, hash});
    }
    for (const PackValue& item : fields.array("missing", 1 << 16)) {
        const PackBytes* name = item.get<PackBytes>();
        if (!name) return bad_input("manifest: field 'missing' must hold names.");
        manifest.missing.push_back(name->bytes);
    }
    if (fields.error()) return *fields.error();
    if (total > k_max_scene_bytes)
        return bad_input(
            fmt::format("The manifest names {} bytes of files; {} are allowed.", total, k_max_scene_bytes));
    return manifest;
}

}  // namespace pathscope
