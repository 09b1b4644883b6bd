#include "pathscope/session/frame_work.hpp"

namespace pathscope {
namespace {

/// The client's own rounds need no deadline: if it is gone, so is the account.
constexpr TimeNs k_for_ever = TimeNs{1} << 61;

}  // namespace

FrameWork::FrameWork(const WorkPlan& plan, EventStore& store)
    : plan_(plan),
      indirect_{Ledger(&store), {}, 0, 0},
      schedule_(plan.schedule, {}),
      direct_schedule_(ScheduleKind::pull, {}) {}

std::vector<Lease> FrameWork::begin(const RenderSettings& settings, Epoch epoch, TimeNs now) {
    grid_ = BlockGrid(settings.width, settings.height, plan_.block_size);
    epoch_ = epoch;
    const auto order =
        make_unit_order(plan_.order, std::uint32_t(grid_.columns()), std::uint32_t(grid_.rows()));
    schedule_ = Schedule(plan_.schedule, order);
    direct_schedule_ = Schedule(ScheduleKind::pull, order);
    direct_schedule_.set_servers({{k_local_server, 0}});
    begin(direct_, settings.direct_spp, settings.quantum, now);
    return begin(indirect_, settings.spp, settings.quantum, now);
}

std::vector<Lease> FrameWork::begin(Part& part, std::uint32_t samples, Quantum quantum, TimeNs now) {
    part.samples = samples;
    part.units_begun = 0;
    part.sums = FrameSums(grid_, quantum);
    return part.ledger.new_epoch({epoch_, grid_.count(), samples, plan_.round_samples}, now);
}

Round FrameWork::round_of(RoundKey key) const {
    const SampleRange samples = samples_of_round(indirect_.ledger.plan(), key.index);
    return grid_.round(key.unit, samples.first, samples.count);
}

std::optional<Lease> FrameWork::grant_direct(TimeNs now) {
    const std::optional<RoundKey> key = direct_schedule_.pick(direct_.ledger, k_local_server);
    return key ? direct_.ledger.grant(k_local_server, *key, now, k_for_ever) : std::nullopt;
}

Commit FrameWork::commit(LightPart part, const ResultClaim& claim, std::span<const PixelSum> sums,
                         TimeNs now) {
    Part& account = part == LightPart::direct ? direct_ : indirect_;
    Commit commit = account.ledger.commit(claim, now);
    if (commit.verdict == Verdict::accepted) {
        account.units_begun += account.sums.samples_of_block(claim.unit) == 0;
        account.sums.add(grid_.round(claim.unit, claim.first, claim.count), sums);
    }
    return commit;
}

double FrameWork::progress(const Part& part) const {
    if (part.samples == 0) return 1;
    return double(part.ledger.rounds_committed()) /
           (double(part.ledger.plan().rounds_per_unit()) * double(grid_.count()));
}

void FrameWork::stop() {
    direct_.ledger.stop();
    indirect_.ledger.stop();
}

}  // namespace pathscope
