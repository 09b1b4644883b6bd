#pragma once
/// The atrium as a list of materials, each with one shape that holds all that is made of it.
///
/// build_house() puts up walls, columns, vaults and roof; furnish() what can be moved. write_model() makes
/// atrium.obj, atrium.mtl and the textures.

#include <filesystem>
#include <map>
#include <string_view>

#include "pathscope/core/result.hpp"
#include "shape.hpp"

namespace pathscope::atrium {

enum class Stuff {
    limestone,
    plaster,
    marble,
    flagstone,
    inlay,
    terracotta,
    oak,
    iron_grille,
    grass,
    bronze,
    brass,
    glaze,
    mirror,
    glass,
    water,
    banner_red,
    banner_blue,
    leaf,
    ivy,
    bark,
    soil,
};

struct Model {
    std::map<Stuff, Shape> parts;

    void add(Stuff stuff, const Shape& shape, const Placement& place = {}) {
        append(parts[stuff], shape, place);
    }
    [[nodiscard]] std::size_t triangles() const;
};

// The plan, in metres. The court lies round the origin, its long axis along z; galleries run round it on two
// floors behind arcades. An arcade stands on the court's edge.
inline constexpr float k_bay = 2.8f;
inline constexpr int k_bays_x = 5, k_bays_z = 10;
inline constexpr float k_half_x = 0.5f * k_bay * k_bays_x, k_half_z = 0.5f * k_bay * k_bays_z;
inline constexpr float k_gallery = 3.4f;       ///< From the arcade's axis to the outer wall.
inline constexpr float k_lower_floor = 0.15f;  ///< One step above the court.
inline constexpr float k_lower_spring = k_lower_floor + 3.3f;
inline constexpr float k_upper_floor = 5.6f;
inline constexpr float k_upper_spring = k_upper_floor + 2.9f;
inline constexpr float k_cornice = 10.1f;

/// One bay of an arcade: its centre on the court's edge, turned so that local z points into the court.
struct Bay {
    int side;   ///< 0 far (-z), 1 left (-x), 2 near (+z), 3 right (+x).
    int index;  ///< From local -x on.
    Placement place;
};
[[nodiscard]] std::vector<Bay> all_bays();
/// The same place, moved in its own frame.
[[nodiscard]] Placement moved(const Placement& place, Vec3 by, float further_turn = 0);

void build_house(Model& model);
void furnish(Model& model);

/// Requires: the folder exists.
[[nodiscard]] Result<void> write_model(const Model& model, const std::filesystem::path& folder);
[[nodiscard]] Result<void> write_textures(const std::filesystem::path& folder);

}  // namespace pathscope::atrium
