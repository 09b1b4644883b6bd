#pragma once
/// A scene file: JSON that says which OBJ files make a scene, how it is lit and from where it is seen.
///
/// Keys: name; obj (a name or a list of names); up_axis ("Y", "Z"); units_to_metres; camera (the default view
/// {name, position, look_at, up, vfov_deg, aspect "W:H"}), cameras (more of them); variants {OBJ: camera};
/// lights [{type, ...}]; materials {name: overrides}; defaults {size [W, H], spp, bounces}; exposure_ev;
/// preview {renderer, view_transform, exposure_ev}. Any other key is an error that names its path.
///
/// Coordinates are kept as they stand in the files, for OBJ, lights and cameras alike: nothing is turned.
/// up_axis only says which way is up where a camera does not.
/// Units: scene units; linear colours; degrees.
///
/// The same text, written by to_json(), travels to render servers as a part of the render state; so
/// parse_scene_file(to_json(f)) == f, to the last bit of every float.
/// Thread safety: values.   Test: tests/scene/test_scene_file.cpp

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/math/vec.hpp"
#include "pathscope/scene/camera.hpp"
#include "pathscope/scene/material.hpp"

namespace pathscope {

enum class UpAxis { y, z };
[[nodiscard]] constexpr Vec3 up_direction(UpAxis axis) {
    return axis == UpAxis::y ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
}

/// The shape of an image that suits a camera, as "16:9".
struct Aspect {
    int width = 16, height = 9;

    friend constexpr bool operator==(const Aspect&, const Aspect&) = default;
};

struct CameraSpec {
    std::string name;
    Camera view;
    std::optional<Aspect> aspect;

    friend bool operator==(const CameraSpec&, const CameraSpec&) = default;
};

/// The Ke of the materials lights the scene. Without this light in the list, no Ke emits.
struct EmissiveMtlSpec {
    bool two_sided = true;  ///< Else only the side that the triangle's normal points to emits.

    friend constexpr bool operator==(const EmissiveMtlSpec&, const EmissiveMtlSpec&) = default;
};

/// The parallelogram corner + a edge_u + b edge_v; emits on the side of edge_u x edge_v, black behind.
struct QuadLightSpec {
    Vec3 corner, edge_u, edge_v;
    Rgb radiance;

    friend constexpr bool operator==(const QuadLightSpec&, const QuadLightSpec&) = default;
};

/// Emits outwards.
struct SphereLightSpec {
    Vec3 centre;
    float radius = 1;
    Rgb radiance;

    friend constexpr bool operator==(const SphereLightSpec&, const SphereLightSpec&) = default;
};

struct PointLightSpec {
    Vec3 position;
    Rgb intensity;  ///< Radiant intensity: irradiance at distance r is intensity / r^2.

    friend constexpr bool operator==(const PointLightSpec&, const PointLightSpec&) = default;
};

/// A disc at infinity.
struct SunSpec {
    Vec3 to_sun{0, 1, 0};     ///< As given, not normalised.
    Rgb irradiance;           ///< On a plane that faces the sun.
    float angle_deg = 0.53f;  ///< Angular diameter; 0 = a direction.

    friend constexpr bool operator==(const SunSpec&, const SunSpec&) = default;
};

/// The same radiance from all directions.
struct SkySpec {
    Rgb radiance;

    friend constexpr bool operator==(const SkySpec&, const SkySpec&) = default;
};

/// A latitude-longitude image at infinity, its upper edge at +y whatever up_axis says.
struct EnvmapSpec {
    std::string file;  ///< Scene-relative.
    float scale = 1;
    float rotate_y = 0;  ///< Degrees about +y, counter-clockwise seen from above.

    friend bool operator==(const EnvmapSpec&, const EnvmapSpec&) = default;
};

using LightSpec = std::variant<EmissiveMtlSpec, QuadLightSpec, SphereLightSpec, PointLightSpec, SunSpec,
                               SkySpec, EnvmapSpec>;

/// Values that replace those of the MTL, in the meaning of Material. A value replaces a map of the same
/// quantity too unless the map is named as well; an empty map name takes the map away.
struct MaterialOverride {
    std::optional<MaterialKind> model;
    std::optional<Rgb> kd, ks, ke;
    std::optional<float> roughness, metallic, ior, opacity;
    std::optional<std::string> map_kd, map_ks, map_ke, map_d, map_roughness;  ///< Scene-relative.

    friend bool operator==(const MaterialOverride&, const MaterialOverride&) = default;
};

/// What programs use where the command line says nothing.
struct RenderDefaults {
    struct Size {
        int width = 0, height = 0;
        friend constexpr bool operator==(const Size&, const Size&) = default;
    };
    std::optional<Size> size;
    std::optional<int> spp;
    std::optional<int> bounces;

    friend constexpr bool operator==(const RenderDefaults&, const RenderDefaults&) = default;
};

/// How a preview picture was made by another renderer; nothing here depends on it.
struct PreviewSpec {
    std::string renderer, view_transform;
    float exposure_ev = 0;

    friend bool operator==(const PreviewSpec&, const PreviewSpec&) = default;
};

struct SceneFile {
    std::string name;
    std::vector<std::string> objs;  ///< At least one; scene-relative.
    UpAxis up_axis = UpAxis::y;
    float units_to_metres = 1;
    std::vector<CameraSpec> cameras;              ///< The first is the default; none = to be chosen.
    std::map<std::string, std::string> variants;  ///< OBJ of the same folder -> name of its camera.
    std::vector<LightSpec> lights;                ///< None = to be chosen; Ke emits then.
    std::map<std::string, MaterialOverride> materials;
    RenderDefaults defaults;
    float exposure_ev = 0;
    std::optional<PreviewSpec> preview;

    friend bool operator==(const SceneFile&, const SceneFile&) = default;
};

/// `shown_path` is how errors name the file. A syntax error names line and column, any other the path of the
/// key: "scene.json: lights[2].colour: unknown key; known are corner, edge_u, edge_v, radiance, type".
[[nodiscard]] Result<SceneFile> parse_scene_file(std::string_view text, const std::string& shown_path);

/// Canonical: equal scenes give equal texts. Requires: what parse_scene_file accepts.
[[nodiscard]] std::string to_json(const SceneFile& scene);

[[nodiscard]] const CameraSpec* find_camera(const SceneFile& scene, std::string_view name);

}  // namespace pathscope
