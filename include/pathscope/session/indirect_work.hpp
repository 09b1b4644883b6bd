#pragma once
/// What a client's servers work on: the seam between looking after servers and knowing the work.
///
///     ClientMachine  --- grant, judge, commit, release, revoke, expire --->  FrameWork   rounds of one frame
///                                                                            RelayWork   leases of a client above
///
/// Why: joining, heartbeats, credits, deadlines and bans are the same whoever wants the light. A client books it into its
/// frame; a relay adds it up and sends it on (relay_work.hpp). Whatever stands here is exactly-once work: a result is booked
/// if and only if its verdict is `accepted`.
/// Requires: `now` never falls. Thread safety: one thread at a time.
/// Test: tests/session/test_frame_work.cpp, test_relay_work.cpp

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "pathscope/cluster/ledger.hpp"
#include "pathscope/cluster/schedule.hpp"
#include "pathscope/render/round_renderer.hpp"

namespace pathscope {

class IndirectWork {
  public:
    virtual ~IndirectWork() = default;

    /// How long a lease on these samples shall last, which were granted so often before.
    using LeaseTime = std::function<TimeNs(const Round& round, std::uint32_t attempts)>;
    /// How long a server would need for so many samples; nothing if it is not known.
    using OwnTime = std::function<std::optional<TimeNs>(double samples)>;

    /// Who may be given rounds.
    virtual void set_servers(std::vector<ServerShare> servers) = 0;

    /// The next rounds for this server that follow each other, at most so many.
    virtual std::optional<Lease> grant_indirect(ServerId server, TimeNs now, std::uint32_t most,
                                                const LeaseTime& duration) = 0;

    /// A second lease on what another server is late with.
    virtual std::optional<Lease> copy_straggler(ServerId server, TimeNs now, const OwnTime& own,
                                                const LeaseTime& duration) = 0;

    [[nodiscard]] virtual Verdict judge(const ResultClaim& claim) const = 0;

    /// Books a result and, if it is accepted, takes its light. `result` without its sums, which are `sums`; `took`: what the
    /// server says it spent on it.
    virtual Commit commit_indirect(const ResultClaim& claim, const RoundResult& result,
                                   std::span<const PixelSum> sums, TimeNs took, TimeNs now) = 0;

    /// Leases that end without a result: their rounds are open again. A lease that is not known is ignored.
    virtual void release(LeaseId lease, ServerId server, TimeNs now) = 0;
    virtual std::size_t revoke(ServerId server, TimeNs now) = 0;  ///< How many leases.
    virtual void expire(TimeNs now) = 0;
    [[nodiscard]] virtual std::optional<TimeNs> next_deadline() const = 0;

    // -- View -----------------------------------------------------------------------------------------------
    [[nodiscard]] virtual Round round_of(const Lease& lease) const = 0;
    /// Requires: judge(claim) is `accepted`.
    [[nodiscard]] virtual PixelRect rect_of(const ResultClaim& claim) const = 0;
    [[nodiscard]] virtual double samples_of_full_round() const = 0;  ///< Of all its pixels.
    [[nodiscard]] virtual std::uint64_t most_pixels() const = 0;     ///< That a lease has.
    [[nodiscard]] virtual std::size_t outstanding() const = 0;
    [[nodiscard]] virtual std::size_t outstanding(ServerId server) const = 0;
    [[nodiscard]] virtual std::uint64_t rounds_open()
        const = 0;  ///< Ever; when it rises there is more to do.
    [[nodiscard]] virtual std::uint64_t rounds_waiting() const = 0;  ///< Open, and nobody holds them.
    [[nodiscard]] virtual bool any_reopened() const = 0;
    [[nodiscard]] virtual std::uint64_t rounds_committed() const = 0;
};

}  // namespace pathscope
