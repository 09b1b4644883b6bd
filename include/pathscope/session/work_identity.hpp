#pragma once
/// Whether two runs render the same frame from the same rounds, so that one may go on where the other ended.
///
///     equal: build, render state but for spp and direct_spp, block size, round size, sampling rule
///
/// Why these: committed rounds are rounds of this grid, cut and numbered so, and their sums are bits of this build and this
/// state. How many samples are asked for is decided by what was committed (FrameWork::restore). All else, such as servers,
/// schedule, order, threads and which tree, changes no bit and may change from run to run.
/// Thread safety: values.   Test: tests/session/test_work_identity.cpp

#include <cstdint>
#include <optional>
#include <string>

#include "pathscope/session/frame_work.hpp"
#include "pathscope/session/render_state.hpp"

namespace pathscope {

struct WorkIdentity {
    std::string build;
    PackMap state;  ///< encode_state().
    int block_size = 0;
    std::uint32_t round_samples = 0;
    SamplingRule sampling;
};

[[nodiscard]] WorkIdentity identity_of(const RenderState& state, const WorkPlan& plan);

/// What differs, by the names of flags, as the end of a sentence: "its --seed is 1, not 2; its --size is 8x8, not 16x8".
[[nodiscard]] std::optional<std::string> difference(const WorkIdentity& theirs, const WorkIdentity& ours);

}  // namespace pathscope
