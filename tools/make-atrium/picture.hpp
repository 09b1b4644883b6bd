#pragma once
/// Textures painted by formula: every picture repeats without a seam in both directions.
///
/// A picture is a function of (u, v) in [0, 1)^2 with v upwards, as in OBJ. Colours are linear with the
/// primaries of sRGB and are encoded when written; a mask is written as it is.
/// Determinism: lattice hashes (math/random.hpp) and float arithmetic, no generator state.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope::atrium {

struct Picture {
    int width = 0, height = 0;
    std::vector<Rgb> pixels;  ///< Top row first.
};

[[nodiscard]] Picture paint(int width, int height, const std::function<Rgb(Vec2)>& colour);

enum class PictureKind { colour, mask };
[[nodiscard]] Result<void> write_png(const std::filesystem::path& path, const Picture& picture,
                                     PictureKind kind);

/// Smooth noise in [0, 1], `cells` lattice cells to the unit.
[[nodiscard]] float noise(Vec2 p, int cells, std::uint32_t seed);
/// Octaves of noise, each twice as fine and half as strong; in [0, 1].
[[nodiscard]] float cloudy(Vec2 p, int cells, int octaves, std::uint32_t seed);

// What the atrium is made of.
[[nodiscard]] Rgb limestone_blocks(Vec2 p);  ///< Courses of cut stone with joints; 2 m to the unit.
[[nodiscard]] Rgb ochre_plaster(Vec2 p);     ///< 4 m
[[nodiscard]] Rgb veined_marble(Vec2 p);     ///< 2 m
[[nodiscard]] Rgb flagstones(Vec2 p);        ///< 4 m
[[nodiscard]] Rgb inlaid_floor(Vec2 p);      ///< One tile of a geometric inlay; 2 m
[[nodiscard]] Rgb terracotta(Vec2 p);        ///< 1 m
[[nodiscard]] Rgb oak(Vec2 p);               ///< Planks along v; 1 m
[[nodiscard]] Rgb damask(Vec2 p, Rgb ground, Rgb thread);  ///< A banner, with border and fringe.
[[nodiscard]] Rgb leaves(Vec2 p);                          ///< The colour behind leaf_mask.
[[nodiscard]] float leaf_mask(Vec2 p);                     ///< A sprig of nine leaves: 1 where there is leaf.
[[nodiscard]] float ivy_mask(Vec2 p);                      ///< One leaf with five lobes.
[[nodiscard]] float grille_mask(Vec2 p);                   ///< Wrought iron: bars, rings and lozenges.

}  // namespace pathscope::atrium
