#include "pathscope/session/server_machine.hpp"

#include <fmt/format.h>

#include <utility>

#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

constexpr int k_max_fetch_failures = 3;

}  // namespace

// ---- Joining, and the state.

void ServerMachine::on(message::Welcome& message) {
    if (session_ != 0 && session_ != message.session) return;
    session_ = message.session;
    credits_ = message.credits;
    heartbeat_ = TimeNs(message.heartbeat_ms) * k_millisecond_ns;
    dead_after_ = TimeNs(message.dead_after_ms) * k_millisecond_ns;
    if (phase_ == Phase::hello) {
        phase_ = Phase::sync;
        next_ping_ = now_;
        send_answer(message::Credit{session_, credits_, received_});
    }
    take_state(message.state, message.epoch, message.sequence, message.state_hash);
}

void ServerMachine::on(message::Reject& message) {
    const TimeNs welcome_again = now_ + TimeNs(message.retry_ms) * k_millisecond_ns;
    if (phase_ != Phase::hello) {
        if (message.code != RejectCode::banned || message.retry_ms == 0) return;
        hello_not_before_ = welcome_again;
        return relink(fmt::format("The client refuses this server for now: {}", message.text));
    }
    if (message.retry_ms == 0)
        return end(
            failed(fmt::format("The client at {} refuses this server: {}", identity_.client, message.text)));
    if (message.code == RejectCode::malformed) {  // Then something is wrong with this connection.
        hello_not_before_ = welcome_again;
        return relink(fmt::format("The client cannot admit it so: {}", message.text));
    }
    log_note(fmt::format("{}: not admitted yet: {}", identity_.name, message.text));
    next_hello_ = welcome_again;
}

void ServerMachine::on(message::Snapshot& message) {
    if (message.session == session_)
        take_state(message.state, message.epoch, message.sequence, message.state_hash);
}

void ServerMachine::take_state(const std::string& bytes, Epoch epoch, std::uint64_t sequence,
                               const Digest& hash) {
    snapshot_asked_.reset();
    if (held_ && sequence < held_->sequence) return;
    if (hash_text(bytes) != hash)
        return log_warning(fmt::format("{}: a render state arrived damaged.", identity_.name));
    const Result<PackValue> value = unpack(bytes, k_payload_limits);
    const PackMap* map = value ? value->get<PackMap>() : nullptr;
    Result<RenderState> state = map ? decode_state(*map) : bad_input("The render state is not a map.");
    if (state) return hold({std::move(*state), epoch, sequence, hash});

    // Another version's levers: this server would render another image.
    send_monitor(message::Bye{ByeReason::error, state.error().message});
    end(failed(fmt::format("Cannot follow the client at {}: {}", identity_.client, state.error().message)));
}

void ServerMachine::on(message::Input& message) {
    if (message.session != session_ || !held_ || message.sequence <= held_->sequence) return;
    const Result<PackValue> value = unpack(message.changes, k_payload_limits);
    const PackMap* changes = value ? value->get<PackMap>() : nullptr;
    if (message.sequence == held_->sequence + 1 && changes) {
        Result<RenderState> state = apply_changes(held_->state, *changes);
        if (state && state_hash(*state) == message.state_hash)
            return hold({std::move(*state), message.epoch, message.sequence, message.state_hash});
    }
    ask_for_snapshot();
}

void ServerMachine::ask_for_snapshot() {
    missed_since_.reset();
    if (snapshot_asked_ && now_ - *snapshot_asked_ < heartbeat_) return;
    if (send_monitor(message::SnapshotRequest{session_, held_ ? held_->sequence : 0})) snapshot_asked_ = now_;
}

/// Takes over a new state: work of other epochs ends, and the scene follows if it is another one.
void ServerMachine::hold(HeldState held) {
    missed_since_.reset();
    held_ = std::move(held);
    for (const auto& [ticket, lease] : leases_)
        if (lease.epoch != held_->epoch) world_.cancel(ticket);
    if (scene_ && same_scene(*scene_state_, held_->state)) return become_ready();
    phase_ = Phase::sync;
    fetch_.emplace(cache_, held_->state.files);
    fetch_failures_ = 0;
    advance_scene();
}

void ServerMachine::become_ready() {
    fetch_.reset();
    phase_ = Phase::work;
    world_.on_state(held_->state);
    send_ready();
}

void ServerMachine::send_ready() {
    send_monitor(message::Ready{session_, held_->epoch, held_->sequence, held_->hash});
}

// ---- The scene.

void ServerMachine::on(message::Manifest& message) {
    if (!fetch_) return;
    if (const auto taken = fetch_->on_manifest(message); !taken) return scene_failed(taken.error());
    advance_scene();
}

void ServerMachine::on(message::Piece& message) {
    if (!fetch_) return;
    if (const auto taken = fetch_->on_piece(std::move(message)); !taken) return scene_failed(taken.error());
    advance_scene();
}

void ServerMachine::advance_scene() {
    if (!world_.reads_files() || fetch_->complete()) {
        if (loading_) return;
        loading_ = world_.reads_files() ? fetch_->manifest() : Manifest{};
        return world_.load(held_->state, *loading_);
    }
    for (Message& request : fetch_->requests(now_)) send_monitor(std::move(request));
}

void ServerMachine::on_loaded(LoadedScene& loaded, TimeNs now) {
    now_ = now;
    const Manifest files = std::exchange(loading_, std::nullopt).value_or(Manifest{});
    // The client may have gone back to the scene that is here, while this one was loaded: its leases are of that one.
    const bool in_use = held_ && scene_ && same_scene(*scene_state_, held_->state);
    if (loaded.scene && !in_use) {
        scene_ = std::move(*loaded.scene);
        scene_state_ = std::move(loaded.state);
    }
    if (!held_ || !fetch_) return;  // The client was lost, or already has what it wants.
    if (!same_scene(loaded.state, held_->state) && !(scene_ && same_scene(*scene_state_, held_->state)))
        return advance_scene();  // It wants another one by now.
    if (scene_ && same_scene(*scene_state_, held_->state)) return become_ready();

    // Perhaps a file of the cache is damaged: fetch all of them anew. They are those of the list that was loaded: another
    // state of this scene may have come meanwhile, whose list is still on its way.
    for (const ManifestEntry& entry : files.files) cache_.forget(entry.hash);
    scene_failed(loaded.scene.error());
}

void ServerMachine::scene_failed(const Error& error) {
    log_warning(fmt::format("{}: {}", identity_.name, error.message));
    if (++fetch_failures_ < k_max_fetch_failures) {
        fetch_.emplace(cache_, held_->state.files);
        return advance_scene();
    }
    send_monitor(message::Bye{ByeReason::error, error.message});
    end(failed(fmt::format("Cannot load the client's scene: {}", error.message)));
}

}  // namespace pathscope
