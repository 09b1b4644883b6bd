#pragma once
/// The work of one frame: two accounts of rounds (direct, indirect) and the light that they brought.
///
///     image = direct / n_direct + indirect / n_indirect
///
/// With a sampling rule that asks for it, the frame goes in passes: scouts are rendered beside the picture, and when all
/// rounds of a pass are committed they decide what the next one holds, or that there is none (cluster/adaptive.hpp).
/// Unit u of a ledger is then block u mod n of the grid's n, of the picture if u < n, else of a half of the scout.
///
/// Why one place: a round is merged if and only if its ledger accepts it, so that committing and adding cannot drift
/// apart. Which server renders what, and over which wire, is the session's business.
/// Direct rounds are the client's own; only indirect ones are counted in the event store, since only they can be lost.
/// Thread safety: one thread at a time.   Test: tests/session/test_frame_work.cpp, test_adaptive_frame.cpp

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pathscope/cluster/adaptive.hpp"
#include "pathscope/cluster/ledger.hpp"
#include "pathscope/cluster/schedule.hpp"
#include "pathscope/integrator/path_estimator.hpp"
#include "pathscope/render/frame_sums.hpp"
#include "pathscope/render/render_settings.hpp"
#include "pathscope/session/frame_snapshot.hpp"
#include "pathscope/session/indirect_work.hpp"

namespace pathscope {

struct WorkPlan {
    int block_size = 32;
    std::uint32_t round_samples = 4;
    ScheduleKind schedule = ScheduleKind::pull;
    UnitOrder order = UnitOrder::spiral;
    SamplingRule sampling{};
    bool can_undo = false;  ///< Keeps what restore() brought, for undo() and begin_anew().
};

class FrameWork final : public IndirectWork {
  public:
    FrameWork(const WorkPlan& plan, EventStore& store);

    /// Begins the frame anew: nothing of the epoch before reaches it. Returns the leases that were outstanding. Who may be
    /// given rounds has to be said again. Requires: with passes, each part's samples are none or at least
    /// least_staged_budget(round_samples).
    std::vector<Lease> begin(const RenderSettings& settings, Epoch epoch, TimeNs now);

    /// The same frame from where this run began with it: nothing, or what restore() brought.
    std::vector<Lease> begin_anew(const RenderSettings& settings, Epoch epoch, TimeNs now);

    /// Puts the indirect light of a unit back to where this run began with it; its rounds are open again. Returns how many.
    /// With passes, what a unit holds has decided about others: only begin_anew() helps. Requires: plan().can_undo, no passes.
    std::size_t undo(std::uint32_t unit, TimeNs now);

    // -- Indirect rounds, of servers: indirect_work.hpp -----------------------------------------------------
    void set_servers(std::vector<ServerShare> servers) override { schedule_.set_servers(std::move(servers)); }
    /// A unit's first round goes alone, so that there is a picture soon.
    std::optional<Lease> grant_indirect(ServerId server, TimeNs now, std::uint32_t most,
                                        const LeaseTime& duration) override;
    std::optional<Lease> copy_straggler(ServerId server, TimeNs now, const OwnTime& own,
                                        const LeaseTime& duration) override;
    [[nodiscard]] Verdict judge(const ResultClaim& claim) const override {
        return indirect_.ledger.judge(claim);
    }
    Commit commit_indirect(const ResultClaim& claim, const RoundResult&, std::span<const PixelSum> sums,
                           TimeNs, TimeNs now) override {
        return commit(LightPart::indirect, claim, sums, now);
    }
    void release(LeaseId lease, ServerId server, TimeNs now) override {
        indirect_.ledger.release(lease, server, now);
    }
    std::size_t revoke(ServerId server, TimeNs now) override {
        return indirect_.ledger.revoke(server, now).size();
    }
    void expire(TimeNs now) override { indirect_.ledger.expire(now); }
    [[nodiscard]] std::optional<TimeNs> next_deadline() const override {
        return indirect_.ledger.next_deadline();
    }
    [[nodiscard]] PixelRect rect_of(const ResultClaim& claim) const override { return rect_of(claim.unit); }
    [[nodiscard]] double samples_of_full_round() const override {
        return double(plan_.block_size) * plan_.block_size * plan_.round_samples;
    }
    [[nodiscard]] std::uint64_t most_pixels() const override {
        return std::uint64_t(plan_.block_size) * std::uint64_t(plan_.block_size);
    }
    [[nodiscard]] std::size_t outstanding() const override { return indirect_.ledger.outstanding(); }
    [[nodiscard]] std::size_t outstanding(ServerId server) const override {
        return indirect_.ledger.outstanding(server);
    }
    [[nodiscard]] std::uint64_t rounds_open() const override { return indirect_.ledger.rounds_open(); }
    [[nodiscard]] std::uint64_t rounds_waiting() const override { return indirect_.ledger.rounds_waiting(); }
    [[nodiscard]] bool any_reopened() const override { return !indirect_.ledger.reopened().empty(); }
    [[nodiscard]] std::uint64_t rounds_committed() const override {
        return indirect_.ledger.rounds_committed();
    }

    // -- Direct rounds, of the client itself ----------------------------------------------------------------
    std::optional<Lease> grant_direct(TimeNs now);
    /// The direct part of the same round, if it is still open: both together cost less than one after the other.
    std::optional<Lease> grant_direct_beside(const Lease& indirect, TimeNs now);
    void release_direct(const Lease& lease, TimeNs now) {
        direct_.ledger.release(lease.id, lease.server, now);
    }

    [[nodiscard]] Round round_of(const Lease& lease) const override {
        return round_of(lease.unit, {lease.first, lease.count});
    }
    [[nodiscard]] Round round_of(std::uint32_t unit, SampleRange samples) const {
        return grid_.round(block_of(unit), samples.first, samples.count);
    }
    /// Requires: a unit of a ledger's plan.
    [[nodiscard]] PixelRect rect_of(std::uint32_t unit) const { return grid_.rect(block_of(unit)); }

    /// Books a result and, if it is accepted, adds its light.
    Commit commit(LightPart part, const ResultClaim& claim, std::span<const PixelSum> sums, TimeNs now);

    [[nodiscard]] Ledger& indirect_ledger() { return indirect_.ledger; }
    [[nodiscard]] const Ledger& indirect_ledger() const { return indirect_.ledger; }
    [[nodiscard]] const FrameSums& direct() const { return direct_.sums; }
    [[nodiscard]] const FrameSums& indirect() const { return indirect_.sums; }
    [[nodiscard]] Epoch epoch() const { return epoch_; }

    /// Share of the samples that are in the image, 0 to 1.
    [[nodiscard]] double direct_progress() const { return progress(direct_); }
    [[nodiscard]] double indirect_progress() const { return progress(indirect_); }
    /// Whether direct light is the part to go on with, so that both grow evenly: by their shares; but round for round until
    /// there is a picture, and if one part goes on until stop() and the other does not.
    [[nodiscard]] bool direct_is_behind() const;
    [[nodiscard]] bool direct_complete() const { return complete(direct_); }
    [[nodiscard]] bool complete() const { return complete(direct_) && complete(indirect_); }

    /// Relative, of the image as it stands, by the scouts of the last finished pass. Nothing without passes, before the
    /// first is finished, and while a block has no sample.
    [[nodiscard]] std::optional<double> estimated_error() const;
    [[nodiscard]] std::uint32_t passes_finished() const { return passes_finished_; }

    /// Whether each block has at least one round of each part that is asked for: only then a picture can be made.
    [[nodiscard]] bool has_image() const { return has_image(direct_) && has_image(indirect_); }

    /// No more rounds: what is there makes the image.
    void stop();

    [[nodiscard]] const WorkPlan& plan() const { return plan_; }
    [[nodiscard]] const BlockGrid& grid() const { return grid_; }

    /// What there is, into a place that may be used again: a copy of all sums is most of the cost.
    void snapshot(FrameSnapshot& into) const;

    /// Takes over what another run had of this frame. More samples than it was to have, or fewer, are fine without
    /// passes, as long as each committed round is one of this plan as well; else, and for what cannot be, an error, and
    /// the frame has to be begun anew. Requires: begin() was called, and no round granted since.
    [[nodiscard]] Result<void> restore(FrameSnapshot snapshot);

  private:
    struct Part {
        Ledger ledger;
        FrameSums sums{};
        std::uint32_t samples = 0;      ///< Budget, per pixel.
        std::uint32_t units_begun = 0;  ///< Blocks with at least one round of picture committed.
        std::array<FrameSums, 2> scouts{};
        std::uint64_t samples_merged = 0;     ///< Of pixels, scouts included.
        std::vector<std::uint32_t> rounds{};  ///< Of each block's picture.
        std::vector<BlockNoise> noise{};      ///< Of the last finished pass, as is `mean`.
        double mean = 0;
    };

    [[nodiscard]] std::uint32_t block_of(std::uint32_t unit) const { return unit % grid_.count(); }
    [[nodiscard]] Round round_of(const RoundRun& run) const;
    [[nodiscard]] bool staged() const { return plan_.sampling.staged(); }
    [[nodiscard]] bool stopped() const { return direct_.ledger.stopped(); }
    [[nodiscard]] PassGoal goal_of(const Part& part) const;
    [[nodiscard]] LedgerPlan plan_of(std::uint32_t samples) const;
    void open_pass(Part& part);
    void open_rounds(Part& part, std::uint32_t scout);
    void snapshot(const Part& part, PartSnapshot& into) const;
    Result<void> restore(Part& part, PartSnapshot snapshot);
    Result<void> restore_pass(Part& part, PartSnapshot& snapshot);
    void measure(Part& part) const;
    void finish_passes();
    [[nodiscard]] double summed_squared_error(const Part& part) const;
    [[nodiscard]] double progress(const Part& part) const;
    [[nodiscard]] bool has_end(const Part& part) const {
        return part.samples < (staged() ? k_sequence_samples : k_open_ended);
    }
    [[nodiscard]] bool complete(const Part& part) const {
        return part.samples == 0 || part.ledger.complete();
    }
    [[nodiscard]] bool has_image(const Part& part) const {
        return part.samples == 0 || part.units_begun == grid_.count();
    }
    std::vector<Lease> begin(Part& part, std::uint32_t samples, Quantum quantum, TimeNs now);

    WorkPlan plan_;
    BlockGrid grid_;
    Epoch epoch_;
    Part direct_, indirect_;
    std::optional<FrameSnapshot> first_;  ///< What restore() brought.
    std::uint32_t passes_finished_ = 0;
    bool last_pass_finished_ = false;
    Schedule schedule_, direct_schedule_;
};

}  // namespace pathscope
