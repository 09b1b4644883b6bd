#pragma once
/// Small frames whose light is made up, for tests of checkpoints: cheap, noisy, and a pure function of block, group and
/// sample as rendered light is.

#include <optional>
#include <utility>
#include <vector>

#include "pathscope/math/random.hpp"
#include "pathscope/session/checkpoint.hpp"

namespace pathscope::testing {

/// 5 x 3 blocks, of which the last column and row are smaller. A plain frame ends with a shorter round.
inline RenderSettings checkpoint_settings(const WorkPlan& plan) {
    RenderSettings settings;
    settings.width = 18;
    settings.height = 11;
    settings.spp = plan.sampling.staged() ? 40 : 14;
    settings.direct_spp = plan.sampling.staged() ? 20 : 5;
    settings.quantum = Quantum{-10};
    return settings;
}

inline RenderState checkpoint_state(const WorkPlan& plan) {
    RenderState state;
    state.scene.name = "made up";
    state.settings = checkpoint_settings(plan);
    return state;
}

inline WorkPlan checkpoint_plan(SamplingRule sampling = {}) {
    WorkPlan plan;
    plan.block_size = 4;
    plan.round_samples = 4;
    plan.sampling = sampling;
    return plan;
}

class MadeUpFrame {
  public:
    explicit MadeUpFrame(const WorkPlan& plan) : MadeUpFrame(plan, checkpoint_state(plan)) {}
    MadeUpFrame(const WorkPlan& plan, RenderState of) : state(std::move(of)), work(plan, store) {
        work.begin(state.settings, Epoch{1}, 0);
    }

    /// Servers hold rounds at once, answer out of order and twice, give some back, and die.
    void advance(HashRng& rng, int steps) {
        for (int step = 0; step < steps && !work.complete(); ++step) {
            const ServerId server{1 + rng.next_u32() % 3};
            work.set_servers({{ServerId{1}, 1}, {ServerId{2}, 5}, {ServerId{3}, 2}});
            const LightPart part = rng.next_u32() % 3 == 0 ? LightPart::direct : LightPart::indirect;
            if (const auto lease = grant(part, server)) held_.emplace_back(part, *lease);
            if (held_.empty() || rng.next_u32() % 2 == 0) continue;
            std::swap(held_[rng.next_u32() % held_.size()], held_.back());
            const auto [of, lease] = held_.back();
            held_.pop_back();
            const std::uint32_t fate = rng.next_u32() % 16;
            if (of == LightPart::indirect && fate == 0)
                work.indirect_ledger().release(lease.id, lease.server, 0);
            else if (of == LightPart::indirect && fate == 1)
                work.indirect_ledger().revoke(lease.server, 0);
            else
                commit(of, lease);
            if (fate == 2) commit(of, lease);  // A duplicate.
        }
    }
    void finish() {
        HashRng rng(1);
        while (!work.complete()) advance(rng, 100);
    }

    [[nodiscard]] Checkpoint checkpoint() const {
        Checkpoint checkpoint;
        checkpoint.work = identity_of(state, work.plan());
        checkpoint.history.runs = 1;
        checkpoint.history.samples = samples_merged;
        checkpoint.history.rounds = work.indirect_ledger().rounds_committed();
        work.snapshot(checkpoint.frame);
        return checkpoint;
    }
    [[nodiscard]] std::string file() const { return encode_checkpoint(checkpoint()); }

    /// As a client does that is started with the file.
    [[nodiscard]] Result<void> resume(std::string bytes) {
        const auto file = CheckpointFile::parse(std::move(bytes), "f.ck");
        if (!file) return file.error();
        if (const auto taken = take_up(*file, state, work, store); !taken) return taken;
        samples_merged = file->history().samples;
        return {};
    }

    RenderState state;
    EventStore store;
    FrameWork work;
    std::uint64_t samples_merged = 0;  ///< Of pixels, of both parts.

  private:
    std::optional<Lease> grant(LightPart part, ServerId server) {
        if (part == LightPart::direct) return work.grant_direct(0);
        return work.grant_indirect(server, 0, 1 + server.value % 3,
                                   [](const Round&, std::uint32_t) { return k_second_ns; });
    }
    void commit(LightPart part, const Lease& lease) {
        const Round round = work.round_of(lease);
        const ResultClaim claim{lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server};
        if (work.commit(part, claim, light(part, round), 0).verdict == Verdict::accepted)
            samples_merged += round.samples();
    }
    /// Some blocks are much noisier than others.
    static std::vector<PixelSum> light(LightPart part, const Round& round) {
        std::vector<PixelSum> sums(std::size_t(round.rect.area()));
        for (std::uint32_t sample = round.first; sample < round.first + round.count; ++sample)
            for (std::size_t pixel = 0; pixel < sums.size(); ++pixel) {
                HashRng rng(((std::uint32_t(part) * 100 + round.block) * 1000 + std::uint32_t(pixel)) *
                                2'654'435'761u +
                            sample);
                const auto value = std::int64_t(1000 + rng.next_u32() % (1 + round.block % 5 * 4000));
                sums[pixel] += {value, value / 2, value / 3};
            }
        return sums;
    }

    std::vector<std::pair<LightPart, Lease>> held_;
};

}  // namespace pathscope::testing
