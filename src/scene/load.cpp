#include "pathscope/scene/load.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "material_library.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/image/io.hpp"
#include "pathscope/scene/obj.hpp"
#include "texture_requests.hpp"

namespace pathscope {
namespace {

MaterialSource grey_material(const std::string& name) {
    MaterialSource grey;
    grey.material.name = name;
    grey.material.kind = MaterialKind::lambert;
    grey.material.kd = {0.5f, 0.5f, 0.5f};
    return grey;
}

void override_map(MapName& map, const std::optional<std::string>& name, bool value_given) {
    if (name)
        map = {scene_name("", *name), {1, 1}, {0, 0}};
    else if (value_given)
        map = {};
}

void apply_override(MaterialSource& source, const MaterialOverride& o) {
    Material& m = source.material;
    m.kind = o.model.value_or(m.kind);
    m.kd = o.kd.value_or(m.kd);
    m.ks = o.ks.value_or(m.ks);
    if (o.model == MaterialKind::mirror && !o.ks && is_zero(m.ks)) m.ks = {1, 1, 1};
    m.ke = o.ke.value_or(m.ke);
    m.roughness = o.roughness.value_or(m.roughness);
    m.metallic = o.metallic.value_or(m.metallic);
    m.ior = o.ior.value_or(m.ior);
    m.opacity = o.opacity.value_or(m.opacity);
    override_map(source.map_kd, o.map_kd, o.kd.has_value());
    override_map(source.map_ks, o.map_ks, o.ks.has_value());
    override_map(source.map_ke, o.map_ke, o.ke.has_value());
    override_map(source.map_d, o.map_d, false);
    override_map(source.map_roughness, o.map_roughness, o.roughness.has_value());
}

/// A metal reflects its colour and has no diffuse part. One written as Kd 0, Ks = F0 is there already. Of a
/// textured material that is half a metal the texture tints all of F0, which is as near as one map comes.
void fold_metallic(MaterialSource& source) {
    Material& m = source.material;
    if (m.metallic == 0 || is_zero(m.kd)) return;
    m.ks = lerp(m.ks, m.kd, m.metallic);
    m.kd = m.kd * (1 - m.metallic);
    if (!source.map_kd.name.empty() && source.map_ks.name.empty()) source.map_ks = source.map_kd;
    if (is_zero(m.kd)) source.map_kd = {};
}

/// Takes away what the kind of material does not use, so that no texture is loaded for nothing.
void simplify(MaterialSource& source, MaterialModel model) {
    Material& m = source.material;
    if (model == MaterialModel::lambert) {
        m.kind = MaterialKind::lambert;
        m.opacity = 1;
        m.metallic = 0;
        if (m.emits()) {  // A light is only a light then, as in the renderers that the model is compared with.
            m.kd = {};
            source.map_kd = {};
        }
    }
    const bool is_glass = m.kind == MaterialKind::dielectric || m.kind == MaterialKind::thin_glass;
    if (is_glass) m.opacity = 1;
    if (m.kind == MaterialKind::standard) return fold_metallic(source);
    source.map_roughness = {};
    if (m.kind != MaterialKind::lambert) {
        m.kd = {};
        source.map_kd = {};
    }
    if (m.kind != MaterialKind::mirror) {
        m.ks = {};
        source.map_ks = {};
    }
}

/// Behind `mesh`. Where only one of the two has uvs or normals, the other gets zeros, which mean none.
void append(Mesh& mesh, Mesh&& more) {
    if (mesh.positions.empty()) {
        mesh = std::move(more);
        return;
    }
    const auto first = std::uint32_t(mesh.positions.size());
    const std::size_t total = mesh.positions.size() + more.positions.size();
    const auto join = [&](auto& all, const auto& added) {
        if (all.empty() && added.empty()) return;
        all.resize(first);
        all.insert(all.end(), added.begin(), added.end());
        all.resize(total);
    };
    join(mesh.positions, more.positions);
    join(mesh.normals, more.normals);
    join(mesh.uvs, more.uvs);
    for (const TriangleIndices& t : more.triangles)
        mesh.triangles.push_back({t.a + first, t.b + first, t.c + first});
    mesh.materials.insert(mesh.materials.end(), more.materials.begin(), more.materials.end());
}

class Loader {
  public:
    Loader(const SceneFile& scene, FileSource& files, const SceneOptions& options,
           const std::optional<MeshCache>& cache)
        : scene_(scene), files_(files), options_(options), cache_(cache), library_(files) {}

    Result<SceneParts> run() {
        for (const std::string& obj : scene_.objs)
            if (const auto added = add_obj(scene_name("", obj)); !added) return added.error();
        if (parts_.mesh.triangles.empty())
            return bad_input(fmt::format("{}: no triangle of this mesh has an area.",
                                         files_.display_name(scene_name("", scene_.objs[0]))));
        if (const auto known = check_override_names(); !known) return known.error();
        finish_materials();
        Result<std::vector<Texture>> textures =
            requests_.load(files_, options_.texel_space, parts_.materials);
        if (!textures) return textures.error();
        parts_.textures = std::move(*textures);
        if (const auto envmap = load_envmap(); !envmap) return envmap.error();
        if (const auto valid = validate(parts_.mesh); !valid) return valid.error();
        return std::move(parts_);
    }

  private:
    Result<void> add_obj(const std::string& obj) {
        Result<ObjModel> model = read_model(obj);
        if (!model) return model.error();
        if (model->degenerate_triangles > 0)
            log_warning(fmt::format("{}: {} triangle{} without area left out.", files_.display_name(obj),
                                    model->degenerate_triangles,
                                    model->degenerate_triangles == 1 ? "" : "s"));
        parts_.degenerate_triangles += model->degenerate_triangles;
        const std::size_t triangles = parts_.mesh.triangles.size() + model->mesh.triangles.size();
        if (triangles > k_max_triangles)
            return bad_input(
                fmt::format("{}: with this file the scene has {} triangles; at most {} are possible.",
                            files_.display_name(obj), triangles, k_max_triangles));

        Result<std::vector<std::uint32_t>> numbers = material_numbers(obj, *model);
        if (!numbers) return numbers.error();
        for (std::uint32_t& material : model->mesh.materials) material = (*numbers)[material];
        append(parts_.mesh, std::move(model->mesh));
        return {};
    }

    /// The OBJ is read in any case: its bytes say which cached mesh is its own, and servers are sent them.
    Result<ObjModel> read_model(const std::string& obj) {
        Result<std::string> text = files_.read(obj);
        if (!text) return text.error();
        const auto parse = [&] {
            return parse_obj(std::move(*text), files_.display_name(obj), options_.smoothing);
        };
        if (!cache_ || text->size() < cache_->limits().least_obj_bytes) return parse();

        const std::optional<Digest> known = files_.known_hash(obj);
        const Digest key = MeshCache::key_of(known ? *known : hash_text(*text), options_.smoothing);
        if (std::optional<ObjModel> cached = cache_->find(key)) return std::move(*cached);
        Result<ObjModel> model = parse();
        if (model) cache_->store(key, *model);
        return model;
    }

    /// The scene's number of each material of an OBJ. Files that share an MTL share its materials.
    Result<std::vector<std::uint32_t>> material_numbers(const std::string& obj, const ObjModel& model) {
        MaterialLibrary::ByName by_name;
        for (const std::string& line : model.material_files)
            if (const auto opened = library_.open(obj, line, by_name); !opened) return opened.error();
        if (model.material_files.empty())
            log_note(fmt::format("{} names no MTL file (mtllib); its surfaces are grey.",
                                 files_.display_name(obj)));

        std::vector<std::uint32_t> numbers;
        for (const std::string& name : model.material_names) {
            const auto source = by_name.find(name);
            if (source != by_name.end()) {
                const auto [entry, is_new] =
                    numbers_.try_emplace(source->second, std::uint32_t(sources_.size()));
                if (is_new) sources_.push_back(*source->second);
                numbers.push_back(entry->second);
                continue;
            }
            if (!by_name.empty()) mention_missing(obj, name);
            numbers.push_back(std::uint32_t(sources_.size()));
            sources_.push_back(grey_material(name));
        }
        return numbers;
    }

    void mention_missing(const std::string& obj, const std::string& name) const {
        log_warning(name.empty() ? fmt::format("{} has faces before any usemtl; they are grey.",
                                               files_.display_name(obj))
                                 : fmt::format("{}: its MTL has no material \"{}\"; what uses it is grey.",
                                               files_.display_name(obj), name));
    }

    /// A misspelt name would change nothing and say nothing.
    Result<void> check_override_names() const {
        std::set<std::string> names;
        for (const MaterialSource& source : sources_) names.insert(source.material.name);
        for (const auto& [name, source] : library_.all()) names.emplace(name);
        for (const auto& [name, ignored] : scene_.materials) {
            if (names.contains(name)) continue;
            constexpr std::size_t k_most_names = 40;
            std::vector<std::string> some(
                names.begin(),
                std::next(names.begin(), std::ptrdiff_t(std::min(names.size(), k_most_names))));
            return bad_input(
                fmt::format("materials[\"{}\"] of the scene file: no MTL of this scene has a material of "
                            "this name; there are {}{}.",
                            name, fmt::join(some, ", "), names.size() > k_most_names ? "..." : ""));
        }
        return {};
    }

    void finish_materials() {
        const EmissiveMtlSpec* emission = nullptr;
        for (const LightSpec& light : scene_.lights)
            if (!emission) emission = std::get_if<EmissiveMtlSpec>(&light);
        const bool ke_emits = emission || scene_.lights.empty();

        std::vector<std::string> switched_off;
        for (MaterialSource& source : sources_) {
            Material& m = source.material;
            if (emission) m.two_sided_emission = emission->two_sided;
            if (m.emits() && !ke_emits) {
                switched_off.push_back(m.name);
                m.ke = {};
            }
            if (const auto o = scene_.materials.find(m.name); o != scene_.materials.end())
                apply_override(source, o->second);
            if (!m.emits()) source.map_ke = {};
            simplify(source, options_.material);
            parts_.materials.push_back(with_requests(source));
        }
        if (!switched_off.empty())
            log_note(fmt::format(
                "The lights of the scene file do not name emissive_mtl, so these materials do not "
                "emit their Ke: {}.",
                fmt::join(switched_off, ", ")));
    }

    Material with_requests(const MaterialSource& source) {
        Material m = source.material;
        m.map_kd = requests_.request(source.map_kd, TextureUsage::colour);
        m.map_ks = requests_.request(source.map_ks, TextureUsage::colour);
        m.map_ke = requests_.request(source.map_ke, TextureUsage::colour);
        m.map_d = requests_.request(source.map_d, TextureUsage::grey);
        m.map_roughness = requests_.request(source.map_roughness, TextureUsage::grey);
        return m;
    }

    Result<void> load_envmap() {
        for (const LightSpec& light : scene_.lights) {
            const auto* spec = std::get_if<EnvmapSpec>(&light);
            if (!spec) continue;
            if (parts_.envmap)
                return bad_input("The scene file names two lights of type envmap; one is possible.");
            const std::string name = scene_name("", spec->file);
            Result<std::string> bytes = files_.read(name);
            if (!bytes) return bytes.error();
            Result<Image> image = decode_hdr(*bytes, files_.display_name(name));
            if (!image) return image.error();
            parts_.envmap = std::move(*image);
        }
        return {};
    }

    const SceneFile& scene_;
    FileSource& files_;
    const SceneOptions& options_;
    const std::optional<MeshCache>& cache_;
    MaterialLibrary library_;
    TextureRequests requests_;
    std::vector<MaterialSource> sources_;
    std::map<const MaterialSource*, std::uint32_t> numbers_;
    SceneParts parts_;
};

}  // namespace

Result<SceneParts> load_scene_parts(const SceneFile& scene, FileSource& files, const SceneOptions& options,
                                    const std::optional<MeshCache>& cache) {
    return Loader(scene, files, options, cache).run();
}

}  // namespace pathscope
