#pragma once
/// The rays that trees are measured with: those that a path tracer would send, kind by kind.
///
///   primary      camera rays, one per pixel, in 16x16 blocks of 4x4 tiles
///   diffuse      one bounce off what the camera sees
///   incoherent   the third bounce: neighbours in the list have nothing in common any more
///   shadow       from what the camera sees towards a light, does anything stand between?
///   shadow3      the same from the vertex that the third bounce leaves
///
/// Why five: packets win on the first kind by a factor of three and lose by as much on the third; a figure without the
/// kind of its rays says nothing. Every surface is diffuse here: bounces are drawn by the cosine, on the side that the
/// path came from. Lights are drawn by power, a sky by the cosine; scenes without
/// emitting triangles thus send their shadow rays to sun and sky. Cut-outs are solid, and analytic spheres are
/// left out, for all trees.
///
/// Where paths leave the scene early, further passes over the image, with other random numbers, fill up the sets; in a
/// scene that is open to all sides, the deep ones may stay shorter than asked for.
///
/// Origins are moved off the surface by 1e-4 of the scene's diagonal, and shadow rays end as much before the light: far
/// beyond the errors of any tree in the comparison, so that all answer the same question.
/// Ensures: the same rays, bit for bit, for any number of threads. Directions have length one.

#include <cstddef>
#include <string_view>
#include <vector>

#include "pathscope/math/ray.hpp"
#include "pathscope/scene/camera.hpp"
#include "pathscope/scene/scene.hpp"

namespace pathscope::bench {

enum class RayQuery {
    closest,  ///< What is hit first, and where?
    any,      ///< Is anything hit?
};

struct RaySet {
    std::string_view name;
    RayQuery query = RayQuery::closest;
    bool coherent = false;  ///< Neighbours in the list begin, or end, close to each other.
    std::vector<Ray> rays;
};

/// Requires: count >= 256. The image is the largest square of whole 16x16 blocks with at most so many pixels.
[[nodiscard]] std::vector<RaySet> make_ray_sets(const Scene& scene, const Camera& camera, std::size_t count);

}  // namespace pathscope::bench
