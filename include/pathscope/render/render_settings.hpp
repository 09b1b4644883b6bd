#pragma once
/// What an image is, apart from the scene and the camera: size, samples, seed, levers, filter.
///
/// Why: these values, the scene and the camera determine every pixel. They are part of the render state that servers
/// are brought up to; nothing else may influence an image.
/// Units: pixels, samples per pixel. Thread safety: values.

#include <array>
#include <cstdint>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/filter/atrous.hpp"
#include "pathscope/filter/joint_bilateral.hpp"
#include "pathscope/image/exact_sum.hpp"
#include "pathscope/image/wire_format.hpp"
#include "pathscope/integrator/settings.hpp"

namespace pathscope {

/// Where the filter of indirect light runs: on each tile at the server, whose block borders then show as seams, or on the
/// whole indirect buffer at the client.
enum class FilterPlace { off, server, client };

constexpr std::array k_filter_place_names{EnumName<FilterPlace>{FilterPlace::off, "off"},
                                          EnumName<FilterPlace>{FilterPlace::server, "server"},
                                          EnumName<FilterPlace>{FilterPlace::client, "client"}};
constexpr const auto& enum_table(FilterPlace) { return k_filter_place_names; }

/// Which filter it is: indirect_filter.hpp.
enum class FilterKind { joint, atrous };

constexpr std::array k_filter_kind_names{EnumName<FilterKind>{FilterKind::joint, "joint"},
                                         EnumName<FilterKind>{FilterKind::atrous, "atrous"}};
constexpr const auto& enum_table(FilterKind) { return k_filter_kind_names; }

struct RenderSettings {
    int width = 640;
    int height = 360;
    std::uint32_t spp = 16;         ///< Indirect samples per pixel.
    std::uint32_t direct_spp = 16;  ///< Direct samples per pixel.
    std::uint32_t seed = 1;
    TransportSettings transport;
    FilterPlace filter = FilterPlace::off;
    FilterKind filter_kind = FilterKind::joint;
    BilateralParams bilateral;            ///< Of FilterKind::joint.
    AtrousParams atrous;                  ///< Of FilterKind::atrous.
    Quantum quantum;                      ///< Step of the exact sums; from quantum_for() of the scene.
    WireFormat wire = WireFormat::exact;  ///< Of sums that come from servers; all but exact lose bits.

    friend bool operator==(const RenderSettings&, const RenderSettings&) = default;
};

}  // namespace pathscope
