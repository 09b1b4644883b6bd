#include "pathscope/session/server_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "pathscope/protocol/block_result.hpp"

namespace pathscope {
namespace {

/// A client within its credits has fewer answers on their way than these and its credits: what is left are CREDIT and NACK.
constexpr std::size_t k_more_answers = 8;

/// What servers behind a relay count may add up to more.
std::uint32_t as_u32(std::uint64_t count) {
    return std::uint32_t(std::min<std::uint64_t>(count, std::numeric_limits<std::uint32_t>::max()));
}

}  // namespace

void ServerWorld::fill_tile(message::Tile& tile, const RoundResult& result, WireFormat format) const {
    put_block_result(tile, result.sums, format);
}

void ServerMachine::on(message::Lease& lease) {
    if (lease.session != session_ || !held_ || holds_lease(lease.lease)) return;
    // Who grants without end and takes no answer would fill the memory with answers. These leases expire.
    if (unsent_answers_.size() > credits_ + k_more_answers) return;
    received_ = std::max(received_, lease.lease);
    if (draining_) return refuse(lease, NackCode::draining);
    if (leases_.size() >= credits_) return refuse(lease, NackCode::busy);
    if (lease.epoch != held_->epoch) {
        if (lease.epoch > held_->epoch) ask_for_snapshot();
        return refuse(lease, NackCode::state);
    }
    if (phase_ != Phase::work) return refuse(lease, NackCode::scene);
    const RenderSettings& settings = held_->state.settings;
    const PixelRect frame{0, 0, settings.width, settings.height};
    const auto strategy = from_name<Strategy>(lease.strategy);
    if (!strategy || !frame.contains(lease.rect) || lease.count > k_max_samples_per_pixel ||
        lease.first > k_max_samples_per_pixel - lease.count || lease.rect.width > k_max_block_size ||
        lease.rect.height > k_max_block_size)
        return refuse(lease, NackCode::unsupported,
                      "This server computes 'blocks' and 'flat', inside the frame.");

    const Round round{lease.unit, lease.rect, lease.first, lease.count};
    const std::uint64_t ticket = ++last_ticket_;
    world_.begin(
        {ticket, LightPart::indirect, round, scene_, held_->state.camera, settings, false, *strategy});
    leases_.emplace(ticket, std::move(lease));
}

bool ServerMachine::holds_lease(LeaseId number) const {
    return std::any_of(leases_.begin(), leases_.end(),
                       [number](const auto& entry) { return entry.second.lease == number; });
}

void ServerMachine::on(message::Cancel& message) {
    if (message.session != session_) return;
    const auto unwanted = [&](const message::Lease& lease) {
        return lease.epoch != message.epoch || std::find(message.leases.begin(), message.leases.end(),
                                                         lease.lease.value) != message.leases.end();
    };
    for (const auto& [ticket, lease] : leases_)
        if (unwanted(lease)) world_.cancel(ticket);
}

void ServerMachine::on_outcome(RoundOutcome& outcome, TimeNs now) {
    now_ = now;
    const auto found = leases_.find(outcome.ticket);
    if (found == leases_.end()) return;  // Of a client that was lost.
    const message::Lease lease = std::move(found->second);
    leases_.erase(found);
    if (!outcome.result)
        return outcome.failure.empty() ? refuse(lease, draining_ ? NackCode::draining : NackCode::cancelled)
                                       : refuse(lease, NackCode::failed, outcome.failure);
    const RoundResult& result = *outcome.result;

    message::Tile tile = message::make_tile(lease);
    tile.rays = result.rays;
    tile.samples = result.samples;
    tile.started_ns = outcome.started;
    tile.render_ns = outcome.duration;
    tile.dropped = result.dropped;
    tile.dropped_count = as_u32(result.dropped_count);
    tile.saturated_count = as_u32(result.saturated_count);
    world_.fill_tile(tile, result, held_->state.settings.wire);
    send_answer(std::move(tile));
}

void ServerMachine::refuse(const message::Lease& lease, NackCode code, std::string text) {
    send_answer(message::Nack{session_, lease.lease, lease.epoch, code, std::move(text)});
}

/// Gives back what was not begun; what is in work goes on.
void ServerMachine::drain(TimeNs now) {
    now_ = now;
    if (!linked_ || phase_ != Phase::work) return;
    draining_ = true;
    send_monitor(message::Bye{ByeReason::draining, "The server was asked to stop."});
    if (leases_.empty()) return;
    for (auto lease = std::next(leases_.begin()); lease != leases_.end(); ++lease)
        if (!world_.works_on(lease->first)) world_.cancel(lease->first);
}

}  // namespace pathscope
