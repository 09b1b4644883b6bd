#include "pathscope/session/server_machine.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_first_hello_pause = 250 * k_millisecond_ns;
constexpr TimeNs k_longest_hello_pause = 5 * k_second_ns;
constexpr TimeNs k_idle_wait = k_second_ns;  ///< Longest wait without a timer due.

}  // namespace

// ---- The link.

void ServerMachine::on_linked(std::string instance, TimeNs now) {
    now_ = now;
    instance_ = std::move(instance);
    linked_ = true;
    phase_ = Phase::hello;
    hello_pause_ = k_first_hello_pause;
    last_heard_ = now_;
    next_hello_ = std::max(now_, hello_not_before_);
}

void ServerMachine::relink(std::string why) {
    if (!relink_reason_) relink_reason_ = std::move(why);
}

void ServerMachine::on_refused(TimeNs now) {
    now_ = now;
    relink_reason_ = "";
}

void ServerMachine::on_connection_lost(TimeNs now) {
    now_ = now;
    hello_not_before_ = now_;
    if (linked_ && phase_ == Phase::hello) next_hello_ = std::min(next_hello_, now_ + k_first_hello_pause);
}

/// Forgets everything about this client but the scene, which the next one may want as well.
void ServerMachine::lose_link() {
    if (!relink_reason_->empty())
        log_note(fmt::format("{}: {} Dialling {} again.", identity_.name, *relink_reason_, identity_.client));
    world_.cancel_all();
    leases_.clear();
    unsent_answers_.clear();
    held_.reset();
    fetch_.reset();
    missed_since_.reset();
    snapshot_asked_.reset();
    session_ = 0;
    received_ = {};
    relink_reason_.reset();
    linked_ = false;
}

void ServerMachine::end(std::optional<Error> refusal) {
    refusal_ = std::move(refusal);
    ended_ = true;
}

// ---- Time.

void ServerMachine::on_timers(TimeNs now) {
    now_ = now;
    if (ended_ || !linked_) return;
    if (relink_reason_) return lose_link();
    if (phase_ == Phase::hello) {
        if (now_ < next_hello_) return;
        send_monitor(message::Hello{instance_, identity_.name, identity_.version, identity_.bits.build,
                                    identity_.threads, identity_.pid, identity_.bits.golden});
        next_hello_ = now_ + hello_pause_;
        hello_pause_ = std::min(2 * hello_pause_, k_longest_hello_pause);
        return;
    }
    if (now_ - last_heard_ >= dead_after_) {
        relink(fmt::format("The client has been silent for {:.1f} s.", to_seconds(now_ - last_heard_)));
        return lose_link();
    }
    if (now_ >= next_ping_) beat();
    if (!held_ || (missed_since_ && now_ - *missed_since_ >= heartbeat_)) ask_for_snapshot();
    if (fetch_) advance_scene();
    flush_answers();
}

/// PING, and what an idle server said last: READY and CREDIT are absolute, and either may have been lost on its way.
void ServerMachine::beat() {
    send_monitor(message::Ping{std::uint64_t(now_), held_ ? held_->sequence : 0, world_.work_done(),
                               std::uint32_t(leases_.size())});
    next_ping_ = now_ + heartbeat_;
    if (!leases_.empty() || !unsent_answers_.empty() || draining_) return;
    send_answer(message::Credit{session_, credits_, received_});
    if (phase_ == Phase::work) send_ready();
}

TimeNs ServerMachine::next_timer(TimeNs now) const {
    TimeNs next = now + k_idle_wait;
    if (!linked_) return next;
    if (relink_reason_) return now;
    if (phase_ == Phase::hello) {
        next = std::min(next, next_hello_);
    } else {
        next = std::min({next, next_ping_, last_heard_ + dead_after_});
        if (missed_since_) next = std::min(next, *missed_since_ + heartbeat_);
        if (!unsent_answers_.empty()) next = std::min(next, now + k_millisecond_ns);
    }
    return std::max(next, now);
}

// ---- Messages.

void ServerMachine::on_message(Frames frames, Channel channel, TimeNs now) {
    now_ = now;
    last_heard_ = now_;
    Decoded decoded = decode(std::move(frames), Role::server, channel);
    if (decoded) return std::visit([this](auto& message) { on(message); }, *decoded);
    if (decoded.error().fault == DecodeFault::version)
        return end(
            failed(fmt::format("The client at {} speaks protocol version {}; this server speaks {}. "
                               "Install the same version on both machines.",
                               identity_.client, decoded.error().version, k_protocol_version)));
    log_warning(
        fmt::format("{}: dropped a message from the client: {}", identity_.name, decoded.error().sentence));
}

void ServerMachine::on(message::Who&) {
    if (phase_ == Phase::hello) return;  // A HELLO is on its way.
    relink("The client does not know this server any more.");
}

void ServerMachine::on(message::Bye& message) {
    message.reason == ByeReason::stop ? end(std::nullopt) : relink("The client has left.");
}

void ServerMachine::on(message::Ping& message) {
    if (held_ && message.sequence > held_->sequence && !missed_since_) missed_since_ = now_;
    send_monitor(message::Pong{message.token, now_, now_, world_.work_done(), std::uint32_t(leases_.size()),
                               world_.leases_at_once()});
}

/// Whether it left. What is lost here is repeated by a timer: HELLO, requests, heartbeats.
bool ServerMachine::send_monitor(Message message) {
    return world_.send(Channel::monitor, encode(std::move(message)));
}

/// An answer must not be lost: it waits until the socket takes it.
void ServerMachine::send_answer(Message message) {
    unsent_answers_.push_back(encode(std::move(message)));
    flush_answers();
}

void ServerMachine::flush_answers() {
    while (!unsent_answers_.empty() && world_.send(Channel::frames, std::move(unsent_answers_.front())))
        unsent_answers_.pop_front();
}

void ServerMachine::say_goodbye(TimeNs now) {
    now_ = now;
    if (phase_ != Phase::hello)
        send_monitor(message::Bye{ByeReason::leaving, "The server was asked to stop."});
}

void ServerMachine::leave(std::string why, TimeNs now) {
    now_ = now;
    if (phase_ != Phase::hello) send_monitor(message::Bye{ByeReason::leaving, why});
    relink_reason_ = std::move(why);
    lose_link();
}

}  // namespace pathscope
