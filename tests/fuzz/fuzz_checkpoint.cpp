/// Checkpoints, behind their seal: what is taken up is an account that balances, and the frame goes on from it to its end.
///
///     bytes = kind-of-frame(u8) file-without-its-seal

#include <array>

#include "../session/checkpoint_frames.hpp"
#include "fuzz_input.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/hash.hpp"

namespace pathscope::fuzz {
namespace {

using pathscope::testing::MadeUpFrame;

constexpr std::array k_rules{SamplingRule{}, SamplingRule{true, 0}, SamplingRule{false, 0.05}};

/// 3 x 2 blocks, of which the last column and row are narrower: few bytes, so that most of them matter.
MadeUpFrame small_frame(std::size_t kind) {
    const WorkPlan plan = pathscope::testing::checkpoint_plan(k_rules[kind]);
    RenderState state = pathscope::testing::checkpoint_state(plan);
    state.settings.width = 9;
    state.settings.height = 5;
    return {plan, state};
}

void check_account(const MadeUpFrame& frame) {
    const auto sound = frame.work.indirect_ledger().check_invariants();
    CHECK(bool(sound), sound.error().message);
}

void resume_from_anything(std::string_view bytes) {
    FuzzInput in(bytes);
    const std::size_t kind = in.below(k_rules.size());
    std::string file(in.rest());
    const Digest seal = hash_text(file);
    file.append(seal.begin(), seal.end());

    MadeUpFrame frame = small_frame(kind);
    if (const auto taken = frame.resume(file); !taken) {
        CHECK(!taken.error().message.empty());
        return;
    }
    check_account(frame);
    MadeUpFrame again = small_frame(kind);
    const auto taken = again.resume(frame.file());
    CHECK(bool(taken), taken.error().message);
    CHECK(again.file() == frame.file());

    frame.finish();
    check_account(frame);
    CHECK(frame.work.complete());
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    for (std::size_t kind = 0; kind < k_rules.size(); ++kind)
        for (const int steps : {0, 20, 90, 100'000}) {
            MadeUpFrame frame = small_frame(kind);
            HashRng rng(std::uint32_t(steps + 1));
            frame.advance(rng, steps);
            const std::string file = frame.file();
            seeds.push_back({char(kind)});
            seeds.back() += file.substr(0, file.size() - sizeof(Digest));
        }
    return seeds;
}

const FuzzTarget k_target{"checkpoint", resume_from_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
