#include "pathscope/session/frame_work.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pathscope/render/scout.hpp"
#include "pathscope/sampling/sampler.hpp"

namespace pathscope {
namespace {

/// Units of one group in the order of the picture's blocks, group after group.
std::vector<std::uint32_t> order_of_groups(std::vector<std::uint32_t> order, std::uint32_t blocks,
                                           std::uint32_t groups) {
    for (std::uint32_t group = 1; group < groups; ++group)
        for (std::uint32_t i = 0; i < blocks; ++i) order.push_back(order[i] + group * blocks);
    return order;
}

}  // namespace

FrameWork::FrameWork(const WorkPlan& plan, EventStore& store)
    : plan_(plan),
      indirect_{.ledger = Ledger(&store)},
      schedule_(plan.schedule, {}),
      direct_schedule_(ScheduleKind::pull, {}) {}

std::vector<Lease> FrameWork::begin(const RenderSettings& settings, Epoch epoch, TimeNs now) {
    grid_ = BlockGrid(settings.width, settings.height, plan_.block_size);
    epoch_ = epoch;
    first_.reset();
    passes_finished_ = 0;
    last_pass_finished_ = false;
    const auto order = order_of_groups(
        make_unit_order(plan_.order, std::uint32_t(grid_.columns()), std::uint32_t(grid_.rows())),
        grid_.count(), staged() ? k_groups : 1);
    schedule_ = Schedule(plan_.schedule, order);
    direct_schedule_ = Schedule(ScheduleKind::pull, order);
    direct_schedule_.set_servers({{k_local_server, 0}});
    begin(direct_, settings.direct_spp, settings.quantum, now);
    return begin(indirect_, settings.spp, settings.quantum, now);
}

std::vector<Lease> FrameWork::begin(Part& part, std::uint32_t samples, Quantum quantum, TimeNs now) {
    part.samples = staged() ? std::min(samples, k_sequence_samples) : samples;
    part.units_begun = 0;
    part.samples_merged = 0;
    part.sums = FrameSums(grid_, quantum);
    std::vector<Lease> dropped = part.ledger.new_epoch(plan_of(part.samples), now);
    if (!staged() || samples == 0) return dropped;
    part.scouts = {FrameSums(grid_, quantum), FrameSums(grid_, quantum)};
    part.rounds.assign(grid_.count(), 0);
    part.noise.clear();
    open_pass(part);
    return dropped;
}

std::vector<Lease> FrameWork::begin_anew(const RenderSettings& settings, Epoch epoch, TimeNs now) {
    const std::optional<FrameSnapshot> first = std::move(first_);
    std::vector<Lease> dropped = begin(settings, epoch, now);
    if (first) {
        const auto restored = restore(*first);
        CHECK(restored);  // As it was before.
    }
    return dropped;
}

std::size_t FrameWork::undo(std::uint32_t unit, TimeNs now) {
    CHECK(plan_.can_undo && !staged());
    Part& part = indirect_;
    const bool begun = part.sums.samples_of_block(unit) > 0;
    const std::uint64_t samples = part.ledger.samples_committed(unit);
    const bool restored = first_ && !first_->indirect.units.empty();
    const std::size_t undone =
        part.ledger.undo(unit, restored ? first_->indirect.units[unit] : UnitSnapshot{}, now);
    const std::uint32_t left = part.ledger.samples_committed(unit);
    part.sums.reset_block(
        unit, left,
        restored ? std::span<const PixelSum>(first_->indirect.sums) : std::span<const PixelSum>());
    part.samples_merged -= (samples - left) * std::uint64_t(rect_of(unit).area());
    part.units_begun -= begun && left == 0;
    return undone;
}

LedgerPlan FrameWork::plan_of(std::uint32_t samples) const {
    LedgerPlan plan{epoch_, grid_.count(), samples, plan_.round_samples};
    if (!staged()) return plan;
    plan.units *= k_groups;
    plan.staged = true;
    plan.group_units = grid_.count();
    plan.group_samples = k_sequence_samples;
    if (plan_.sampling.adaptive &&
        samples > 0)  // A noisy block may get far more than the mean; whole rounds only.
        plan.samples = k_sequence_samples / plan_.round_samples * plan_.round_samples;
    else if (samples > 0)
        plan.samples = goal_of_pass(~0u, samples, plan_.round_samples).picture;
    return plan;
}

// ---- Passes.

PassGoal FrameWork::goal_of(const Part& part) const {
    if (part.samples == 0) return {0, 0, true};
    return goal_of_pass(passes_finished_, part.samples, plan_.round_samples);
}

void FrameWork::open_pass(Part& part) {
    if (part.samples == 0) return;
    const PassGoal goal = goal_of(part);
    const LedgerPlan& plan = part.ledger.plan();
    if (plan_.sampling.adaptive && passes_finished_ > 0)
        allocate_rounds(part.rounds, part.noise, {plan.round_samples, goal.picture, plan.rounds_per_unit()});
    else
        part.rounds.assign(grid_.count(), (goal.picture + plan.round_samples - 1) / plan.round_samples);
    open_rounds(part, goal.scout);
}

void FrameWork::open_rounds(Part& part, std::uint32_t scout) {
    for (std::uint32_t block = 0; block < grid_.count(); ++block) {
        part.ledger.open(block, part.rounds[block]);
        for (std::uint32_t group = 1; group < k_groups; ++group)
            part.ledger.open(group * grid_.count() + block, scout);
    }
}

void FrameWork::measure(Part& part) const {
    if (part.samples == 0) return;
    const std::vector<double> variance = variance_of_blocks(part.scouts[0], part.scouts[1]);
    part.noise.clear();
    for (std::uint32_t block = 0; block < grid_.count(); ++block)
        part.noise.push_back({variance[block], std::uint32_t(grid_.rect(block).area())});
    part.mean = mean_radiance(part.scouts[0], part.scouts[1]);
}

/// At the end of a pass, begins the next; more than one if a pass holds nothing new.
void FrameWork::finish_passes() {
    while (staged() && !stopped() && !last_pass_finished_ && complete()) {
        measure(direct_);
        measure(indirect_);
        last_pass_finished_ = goal_of(direct_).last && goal_of(indirect_).last;
        ++passes_finished_;
        const double target = plan_.sampling.target_error;
        if (target > 0 && *estimated_error() <= target) last_pass_finished_ = true;
        if (last_pass_finished_) return;
        open_pass(direct_);
        open_pass(indirect_);
    }
}

double FrameWork::summed_squared_error(const Part& part) const {
    if (part.samples == 0) return 0;
    std::vector<std::uint32_t> samples(grid_.count());
    for (std::uint32_t block = 0; block < grid_.count(); ++block)
        samples[block] = part.sums.samples_of_block(block);
    return pathscope::summed_squared_error(part.noise, samples);
}

std::optional<double> FrameWork::estimated_error() const {
    if (passes_finished_ == 0 || !has_image()) return std::nullopt;
    const double squared = summed_squared_error(direct_) + summed_squared_error(indirect_);
    const auto mean_of = [](const Part& part) { return part.samples == 0 ? 0.0 : part.mean; };
    return relative_error(squared, mean_of(direct_) + mean_of(indirect_),
                          std::uint64_t(grid_.width()) * std::uint64_t(grid_.height()));
}

// ---- Rounds.

Round FrameWork::round_of(const RoundRun& run) const {
    return round_of(run.first.unit, samples_of(indirect_.ledger.plan(), run));
}

std::optional<Lease> FrameWork::grant_indirect(ServerId server, TimeNs now, std::uint32_t most,
                                               const LeaseTime& duration) {
    Ledger& ledger = indirect_.ledger;
    const std::optional<RoundKey> key = schedule_.pick(ledger, server);
    if (!key) return std::nullopt;
    const RoundRun run = ledger.grantable(*key, key->index == 0 ? 1 : most);
    return ledger.grant(server, run, now, duration(round_of(run), ledger.attempts(*key)));
}

std::optional<Lease> FrameWork::copy_straggler(ServerId server, TimeNs now, const OwnTime& own,
                                               const LeaseTime& duration) {
    Ledger& ledger = indirect_.ledger;
    const auto late = pick_straggler(
        ledger, server, now, [&](const Lease& lease) { return own(double(round_of(lease).samples())); });
    if (!late) return std::nullopt;
    const RoundKey first = ledger.rounds_of(*late).first;
    return ledger.grant_copy(server, first, now, duration(round_of(*late), ledger.attempts(first)));
}

std::optional<Lease> FrameWork::grant_direct(TimeNs now) {
    const std::optional<RoundKey> key = direct_schedule_.pick(direct_.ledger, k_local_server);
    return key ? direct_.ledger.grant(k_local_server, *key, now, k_no_deadline) : std::nullopt;
}

std::optional<Lease> FrameWork::grant_direct_beside(const Lease& indirect, TimeNs now) {
    const auto run = direct_.ledger.rounds_in(indirect.unit, {indirect.first, indirect.count});
    return run ? direct_.ledger.grant(k_local_server, *run, now, k_no_deadline) : std::nullopt;
}

Commit FrameWork::commit(LightPart part, const ResultClaim& claim, std::span<const PixelSum> sums,
                         TimeNs now) {
    Part& account = part == LightPart::direct ? direct_ : indirect_;
    Commit commit = account.ledger.commit(claim, now);
    if (commit.verdict != Verdict::accepted) return commit;
    const std::uint32_t group = account.ledger.plan().group_of(claim.unit);
    const Round round = grid_.round(block_of(claim.unit), claim.first, claim.count);
    account.units_begun += group == 0 && account.sums.samples_of_block(round.block) == 0;
    (group == 0 ? account.sums : account.scouts[group - 1]).add(round, sums);
    account.samples_merged += round.samples();
    finish_passes();
    return commit;
}

double FrameWork::progress(const Part& part) const {
    if (part.samples == 0) return 1;
    if (staged()) {
        const double budget = double(part.samples) * double(grid_.width()) * double(grid_.height());
        return last_pass_finished_ ? 1 : std::min(1.0, double(part.samples_merged) / budget);
    }
    return double(part.ledger.rounds_committed()) /
           (double(part.ledger.plan().rounds_per_unit()) * double(grid_.count()));
}

bool FrameWork::direct_is_behind() const {
    if (!has_image() || has_end(direct_) != has_end(indirect_))
        return indirect_.ledger.rounds_committed() > direct_.ledger.rounds_committed();
    return indirect_progress() > direct_progress();
}

void FrameWork::stop() {
    direct_.ledger.stop();
    indirect_.ledger.stop();
}

}  // namespace pathscope
