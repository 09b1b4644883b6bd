#pragma once
/// What all filters ask of their parameters and pictures.

#include <fmt/format.h>

#include <initializer_list>

#include "pathscope/filter/joint_bilateral.hpp"

namespace pathscope {

struct NamedSigma {
    const char* name;
    float value;
};

[[nodiscard]] inline Result<void> check_sigmas(std::initializer_list<NamedSigma> sigmas) {
    for (const auto& [name, value] : sigmas)
        if (!(value >= k_min_filter_sigma))
            return bad_input(fmt::format("A filter sigma_{} of {} is not possible: it is at least {}.", name,
                                         value, k_min_filter_sigma));
    return {};
}

template <class Params>
void check_inputs(const Image& noisy, const Guides& guides, const Params& params) {
    const auto params_are_good = check_params(params);
    CHECK(params_are_good, params_are_good ? "" : params_are_good.error().message);
    const auto fits = [&](const auto& guide) { return guide.empty() || guide.rect() == noisy.rect(); };
    CHECK(fits(guides.normal) && fits(guides.albedo) && fits(guides.depth), noisy.rect(),
          guides.normal.rect(), guides.albedo.rect(), guides.depth.rect());
    CHECK(!params.demodulate_albedo || noisy.empty() || !guides.albedo.empty(), noisy.rect());
}

}  // namespace pathscope
