#pragma once
/// The filter of indirect light, whichever the settings name.
///
///   FilterKind::joint   one square of neighbours (filter/joint_bilateral.hpp): settings.bilateral
///   FilterKind::atrous  a few passes of 25 neighbours, wider and wider (filter/atrous.hpp): settings.atrous
///
/// Thread safety: pure.   Test: tests/render/test_tile_filter.cpp

#include "pathscope/render/render_settings.hpp"

namespace pathscope {

/// Requires: guides of the picture's size, all of them; settings that check_params() allows. threads: 0 = all cores.
[[nodiscard]] inline Image filter_indirect(const Image& noisy, const Guides& guides,
                                           const RenderSettings& settings, int threads) {
    if (settings.filter_kind == FilterKind::atrous) return atrous(noisy, guides, settings.atrous, threads);
    return joint_bilateral(noisy, guides, settings.bilateral, threads);
}

}  // namespace pathscope
