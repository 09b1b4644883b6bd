#include "pathscope/session/frame_snapshot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/session/frame_work.hpp"

namespace pathscope {
namespace {

/// Each pass is twice as long as the one before, and no budget has more than 32 bits.
constexpr std::uint32_t k_most_passes = 33;

}  // namespace

void FrameWork::snapshot(FrameSnapshot& into) const {
    into.passes_finished = passes_finished_;
    into.last_pass_finished = last_pass_finished_;
    snapshot(direct_, into.direct);
    snapshot(indirect_, into.indirect);
}

void FrameWork::snapshot(const Part& part, PartSnapshot& into) const {
    if (part.samples == 0) {
        into = {};
        return;
    }
    const auto copy = [](const FrameSums& from, std::vector<PixelSum>& to) {
        to.assign(from.sums().begin(), from.sums().end());
    };
    into.samples = part.samples;
    into.units.resize(part.ledger.plan().units);
    for (std::uint32_t unit = 0; unit < into.units.size(); ++unit) {
        UnitSnapshot& account = into.units[unit];
        account = part.ledger.snapshot(unit);
        // Rounds at the end that were granted only are as good as fresh.
        while (!account.missing.empty() && account.missing.back() + 1 == account.reached) {
            account.missing.pop_back();
            --account.reached;
        }
    }
    copy(part.sums, into.sums);
    if (!staged()) return;
    into.rounds = part.rounds;
    for (std::size_t half = 0; half < part.scouts.size(); ++half) copy(part.scouts[half], into.scouts[half]);
    into.variance.clear();
    for (const BlockNoise& noise : part.noise) into.variance.push_back(noise.variance);
    into.mean = part.mean;
}

Result<void> FrameWork::restore(FrameSnapshot snapshot) {
    passes_finished_ = snapshot.passes_finished;
    last_pass_finished_ = snapshot.last_pass_finished;
    const bool no_pass = last_pass_finished_ && passes_finished_ == 0;
    if (no_pass || passes_finished_ > (staged() ? k_most_passes : 0))
        return bad_input("Its passes are not those of this frame.");
    if (plan_.can_undo) first_ = snapshot;
    if (const auto done = restore(direct_, std::move(snapshot.direct)); !done) return done;
    if (const auto done = restore(indirect_, std::move(snapshot.indirect)); !done) return done;
    if (last_pass_finished_ && !complete())
        return bad_input("It says that the last pass is finished, but rounds of it are missing.");
    finish_passes();  // Of a frame that was stopped, the pass may have become complete since.
    return {};
}

Result<void> FrameWork::restore(Part& part, PartSnapshot snapshot) {
    if (staged() && snapshot.samples != part.samples)
        return bad_input(fmt::format(
            "It is of {} samples per pixel, not {}: with --adaptive on or --target-error the passes "
            "depend on that number.",
            snapshot.samples, part.samples));
    if (snapshot.samples == 0) return {};
    const LedgerPlan& plan = part.ledger.plan();
    LedgerPlan earlier = plan;
    if (!staged()) earlier.samples = snapshot.samples;
    if (snapshot.units.size() != plan.units)
        return bad_input(fmt::format("It has {} units, not {}.", snapshot.units.size(), plan.units));
    if (staged())
        if (const auto done = restore_pass(part, snapshot); !done) return done;

    std::array<std::vector<std::uint32_t>, k_groups> samples;
    for (std::uint32_t unit = 0; unit < plan.units; ++unit) {
        const UnitSnapshot& account = snapshot.units[unit];
        // Of two plans, only the last round of either can hold other samples than the same one of the other.
        const RoundKey last{unit, account.reached - 1};
        if (account.reached > 0 &&
            (account.reached > plan.rounds_of(unit) || account.reached > earlier.rounds_of(unit) ||
             samples_of_round(plan, last) != samples_of_round(earlier, last)))
            return bad_input(fmt::format(
                "It has rounds of a frame with {} samples per pixel, which one with {} has not: give "
                "the same number, or a larger one if the old one is a multiple of --round ({}).",
                snapshot.samples, part.samples, plan.round_samples));
        if (const auto restored = part.ledger.restore(unit, account); !restored) return restored;
        samples[plan.group_of(unit)].push_back(part.ledger.samples_committed(unit));
        part.samples_merged +=
            std::uint64_t(part.ledger.samples_committed(unit)) * std::uint64_t(rect_of(unit).area());
    }
    part.units_begun = std::uint32_t(grid_.count() - std::count(samples[0].begin(), samples[0].end(), 0u));
    const auto take = [&](FrameSums& sums, std::vector<PixelSum>& from, std::size_t group) -> Result<void> {
        auto restored =
            FrameSums::restored(grid_, sums.quantum(), std::move(from), std::move(samples[group]));
        if (!restored) return restored.error();
        sums = std::move(*restored);
        return {};
    };
    if (const auto done = take(part.sums, snapshot.sums, 0); !done) return done;
    for (std::size_t half = 0; staged() && half < part.scouts.size(); ++half)
        if (const auto done = take(part.scouts[half], snapshot.scouts[half], half + 1); !done) return done;
    return {};
}

/// The rounds that the pass under way, or the last, had opened, and the noise that decided about them.
Result<void> FrameWork::restore_pass(Part& part, PartSnapshot& snapshot) {
    const std::uint32_t most = part.ledger.plan().rounds_of(0);
    const bool rounds_fit = snapshot.rounds.size() == part.rounds.size() &&
                            std::equal(snapshot.rounds.begin(), snapshot.rounds.end(), part.rounds.begin(),
                                       [most](std::uint32_t rounds, std::uint32_t of_first_pass) {
                                           return rounds >= of_first_pass && rounds <= most;
                                       });
    const auto is_variance = [](double number) { return number >= 0 && std::isfinite(number); };
    const bool noise_fits = snapshot.variance.size() == (passes_finished_ > 0 ? grid_.count() : 0) &&
                            std::all_of(snapshot.variance.begin(), snapshot.variance.end(), is_variance) &&
                            is_variance(snapshot.mean);
    if (!rounds_fit || !noise_fits) return bad_input("Its passes are not those of this frame.");
    part.rounds = std::move(snapshot.rounds);
    part.noise.clear();
    for (std::uint32_t block = 0; block < snapshot.variance.size(); ++block)
        part.noise.push_back({snapshot.variance[block], std::uint32_t(grid_.rect(block).area())});
    part.mean = snapshot.mean;
    const std::uint32_t pass = last_pass_finished_ ? passes_finished_ - 1 : passes_finished_;
    open_rounds(part, goal_of_pass(pass, part.samples, plan_.round_samples).scout);
    return {};
}

}  // namespace pathscope
