#pragma once
/// How far is a picture of few samples from the truth, before a filter and after it?
///
/// The picture is the indirect light of a scene, which is what filters are for; the truth is the same of many samples with
/// another seed, whose own noise adds sqrt(1 + spp / reference_spp) to what it measures. Why: a filter always looks
/// better. What it takes from noise it may add in blur, and only the sum of both says whether samples were saved.

#include <nlohmann/json.hpp>

#include "bench.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope::bench {

/// One row for each scene and filter; prints them as a table. No rows where the options name no scene.
[[nodiscard]] Result<nlohmann::ordered_json> measure_filter_errors(const BenchOptions& options);

}  // namespace pathscope::bench
