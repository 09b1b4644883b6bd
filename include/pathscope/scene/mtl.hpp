#pragma once
/// Reads MTL, the material file of OBJ. What each statement means here is the table in material.hpp.
///
/// Why not the reader of tinyobjloader: it gives a value that is missing and one that is zero the same face (so
/// Pr 0, a polished metal, looks like no Pr at all), takes malformed numbers for zero, Kd 0.5 for red, and the
/// name of a map for the third number of its -s 2 2.
///
/// Statements that change how a surface looks and are not used (bump, disp, refl, sheen...) are listed, for one
/// note per file.
///
/// Thread safety: yes.   Test: tests/scene/test_mtl.cpp

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/scene/material.hpp"

namespace pathscope {

/// An image by its name, as written; empty = none. -s and -o of MTL are read, other options listed as unused.
struct MapName {
    std::string name;
    Vec2 scale{1, 1};
    Vec2 offset{0, 0};

    friend bool operator==(const MapName&, const MapName&) = default;
};

/// A material whose textures are not loaded yet.
struct MaterialSource {
    Material material;  ///< Without textures; metallic is not folded yet.
    MapName map_kd, map_ks, map_ke, map_d, map_roughness;
};

struct MtlFile {
    std::vector<MaterialSource> materials;  ///< In the order of the file; of equal names the first counts.
    std::set<std::string> unused;           ///< Statements and map options that were passed over.
    std::vector<std::string> oddities;      ///< Sentences with file and line.
};

/// `shown_path` is how errors name the file.
[[nodiscard]] Result<MtlFile> parse_mtl(std::string_view text, const std::string& shown_path);

}  // namespace pathscope
