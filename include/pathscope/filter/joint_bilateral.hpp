#pragma once
/// Joint bilateral filter: a mean over neighbours that look alike in noise-free guides.
///
///   out(p) = sum_q w(p,q) c(q) / sum_q w(p,q)            q in the square of (2 radius + 1)^2 pixels around p
///   w(p,q) = exp(-1/2 ( |p - q|^2         / sigma_spatial^2      distance on the screen, in pixels
///                     + |n_p - n_q|^2     / sigma_normal^2       difference of unit normals: 0 .. 2
///                     + (ln z_p - ln z_q)^2 / sigma_depth^2      relative difference of depth
///                     + |a_p - a_q|^2     / sigma_albedo^2 ))    difference of albedo: 0 .. sqrt(3)
///
/// Why: noise of path tracing is independent from pixel to pixel, light mostly is not, so the mean of k alike
/// pixels has 1/k of the variance. On a flat region the variance falls by sum(w^2) / (sum w)^2. Edges of the
/// picture are nearly always edges of normal, depth or albedo, and those are known without noise: they "join"
/// the filter. What the guides do not show (a shadow on a plain floor) is blurred: filter indirect light, not
/// direct. Why ln z: its difference is the relative one, so sigma_depth suits a teapot and a town alike, and
/// every guide is a coordinate of one space where w is a plain Gaussian of distance: one exponential per
/// neighbour. Demodulation: c / max(albedo, 1/64) is filtered and multiplied back after, so that texture
/// passes unharmed and only the light on it is blurred; then sigma_albedo may be wide or infinite. Where
/// there is no surface (depth 0, negative or infinite) pixels mix among themselves only. A pixel whose
/// colour, normal, albedo or depth is not a number lends nothing to others and is copied through.
/// Determinism: neighbours are added in one fixed order, and the exponential is ours (the C library's differs
/// from machine to machine), so the result has the same bits for any number of threads. A rectangle filtered
/// alone sees nothing outside it: seams at block borders, to be seen and explained. Source: Eisemann & Durand
/// 2004, "Flash Photography Enhancement via Intrinsic Relighting"; Petschnigg et al. 2004,
///         "Digital Photography with Flash and No-Flash Image Pairs"; Tomasi & Manduchi 1998, "Bilateral
///         Filtering".
/// Thread safety: yes.   Test: tests/filter/test_joint_bilateral.cpp

#include "pathscope/core/result.hpp"
#include "pathscope/image/image.hpp"

namespace pathscope {

/// What steers the filter; all of the noisy picture's size, or empty where a guide is not used.
struct Guides {
    Image normal;  ///< Unit normals of the first surface, in any one frame; zero where there is none.
    Image albedo;  ///< 0 .. 1
    Plane depth;   ///< Distance to the first surface, in scene units; 0 or infinity where there is none.
};

/// A sigma of infinity switches its term off.
struct BilateralParams {
    int radius = 7;              ///< In pixels; 0 returns the picture unchanged.
    float sigma_spatial = 3.5f;  ///< In pixels; half the radius keeps 95 % of the Gaussian in each direction.
    float sigma_normal = 0.2f;   ///< 0.2 is an angle of 11 degrees.
    float sigma_depth = 0.05f;   ///< 0.05 is 5 % of the depth.
    float sigma_albedo = 0.1f;
    bool demodulate_albedo = false;  ///< Requires the guide.

    friend bool operator==(const BilateralParams&, const BilateralParams&) = default;
};

inline constexpr int k_max_filter_radius = 64;
inline constexpr float k_min_filter_sigma = 1e-3f;

/// Whether these can be used: 0 <= radius <= k_max_filter_radius, every sigma >= k_min_filter_sigma. The
/// sentence of the error names the parameter; ask this of what people type and peers send.
[[nodiscard]] Result<void> check_params(const BilateralParams& params);

/// Requires: check_params(params); guides as above. threads: 0 = all cores.
[[nodiscard]] Image joint_bilateral(const Image& noisy, const Guides& guides, const BilateralParams& params,
                                    int threads = 0);

/// The pixels of `rect` filtered alone, as a server filters its block: a picture of rect's size.
/// Requires: as above; rect lies in the picture.
[[nodiscard]] Image joint_bilateral(const Image& noisy, const Guides& guides, const BilateralParams& params,
                                    PixelRect rect, int threads = 0);

/// w(p,q) of the two pixels, straight from the equation: the slow twin that tests hold the fast code against,
/// and that a panel asks for the kernel under the cursor. 0 beyond the radius, and where a guide is not a
/// number. Requires: check_params(params); both pixels lie in every guide used.
[[nodiscard]] float bilateral_weight(const Guides& guides, const BilateralParams& params, int px, int py,
                                     int qx, int qy);

}  // namespace pathscope
