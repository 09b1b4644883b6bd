#include "pathscope/cluster/peer.hpp"

#include <set>
#include <vector>

#include "testing.hpp"

using namespace pathscope;

TEST_CASE(
    "the table is sound: one row per state and cause, a reason in each, everything reachable, no way back") {
    std::set<std::pair<PeerState, PeerCause>> seen;
    for (const PeerTransition& row : peer_transitions()) {
        CHECK(seen.emplace(row.from, row.cause).second);
        CHECK(row.reason.size() > 10);
        CHECK(find_transition(row.from, row.cause) == &row);
        CHECK(row.from != PeerState::gone);
        if (row.from == PeerState::dead) CHECK(row.to == PeerState::gone);
    }
    std::set<PeerState> reached{PeerState::fresh};
    for (std::size_t i = 0; i < k_peer_state_names.size(); ++i)
        for (const PeerTransition& row : peer_transitions())
            if (reached.contains(row.from)) reached.insert(row.to);
    CHECK(reached.size() == k_peer_state_names.size());
}

TEST_CASE("from every living state a server can be lost and can leave") {
    for (const auto& [state, name] : k_peer_state_names) {
        if (state == PeerState::dead || state == PeerState::gone) continue;
        CHECK(find_transition(state, PeerCause::lost)->to == PeerState::dead);
        CHECK(find_transition(state, PeerCause::left)->to == PeerState::gone);
    }
}

TEST_CASE("a life: hello, ready, silent, heard, silent, lost, gone") {
    Peer peer(ServerId{3}, 10);
    CHECK(peer.state() == PeerState::fresh);
    const std::vector<std::pair<PeerCause, PeerState>> life{
        {PeerCause::welcomed, PeerState::syncing}, {PeerCause::synced, PeerState::ready},
        {PeerCause::silent, PeerState::suspect},   {PeerCause::heard, PeerState::ready},
        {PeerCause::silent, PeerState::suspect},   {PeerCause::lost, PeerState::dead},
        {PeerCause::removed, PeerState::gone}};
    TimeNs now = 10;
    for (const auto& [cause, state] : life) {
        const PeerTransition* const row = peer.apply(cause, ++now);
        REQUIRE(row != nullptr);
        CHECK(peer.state() == state);
        CHECK(peer.since() == now);
        CHECK(peer.accepts_work() == (state == PeerState::ready));
        CHECK(peer.alive() == (state != PeerState::dead && state != PeerState::gone));
    }
    CHECK(peer.refused() == 0);
}

TEST_CASE("every step that is not in the table is refused and counted, and changes nothing") {
    for (const auto& [state, state_name] : k_peer_state_names)
        for (const auto& [cause, cause_name] : k_peer_cause_names) {
            if (find_transition(state, cause) != nullptr) continue;
            // Any way into that state.
            Peer peer(ServerId{1}, 0);
            if (state != PeerState::fresh && state != PeerState::dead && state != PeerState::gone)
                peer.apply(PeerCause::welcomed, 1);
            if (state == PeerState::ready || state == PeerState::suspect || state == PeerState::stuck)
                peer.apply(PeerCause::synced, 1);
            if (state == PeerState::suspect) peer.apply(PeerCause::silent, 1);
            if (state == PeerState::stuck) peer.apply(PeerCause::stuck, 1);
            if (state == PeerState::draining) peer.apply(PeerCause::drain, 1);
            if (state == PeerState::dead) peer.apply(PeerCause::lost, 1);
            if (state == PeerState::gone) peer.apply(PeerCause::left, 1);
            REQUIRE(peer.state() == state);
            CHECK(peer.apply(cause, 2) == nullptr);
            CHECK(peer.state() == state);
            CHECK(peer.since() <= 1);
            CHECK(peer.refused() == 1);
        }
}

TEST_CASE("a detector's opinion becomes at most one step") {
    Peer peer(ServerId{1}, 0);
    peer.apply(PeerCause::welcomed, 0);
    CHECK(peer.apply(Liveness::suspect, 1) == nullptr);  // it holds no lease that could be copied
    peer.apply(PeerCause::synced, 1);
    CHECK(peer.apply(Liveness::alive, 1) == nullptr);
    CHECK(peer.apply(Liveness::suspect, 2)->to == PeerState::suspect);
    CHECK(peer.apply(Liveness::suspect, 3) == nullptr);
    CHECK(peer.apply(Liveness::alive, 4)->to == PeerState::ready);
    CHECK(peer.apply(Liveness::dead, 5)->to == PeerState::dead);
    CHECK(peer.apply(Liveness::dead, 6) == nullptr);
    CHECK(peer.apply(Liveness::alive, 6) == nullptr);
    CHECK(peer.refused() == 0);
}

TEST_CASE("credits bound what a server owes, come back with answers, and are written off in the end") {
    Credits credits(2);
    CHECK(credits.available());
    credits.take(LeaseId{1}, 0, 100);
    credits.take(LeaseId{2}, 0, 200);
    CHECK_FALSE(credits.available());
    CHECK_FALSE(credits.settle(LeaseId{3}));
    CHECK(credits.settle(LeaseId{2}));
    CHECK_FALSE(credits.settle(LeaseId{2}));
    CHECK(credits.available());
    CHECK(credits.write_off(99) == 0);
    CHECK(credits.write_off(100) == 1);
    CHECK(credits.owed() == 0);
    credits.take(LeaseId{4}, 0, 100);
    credits.set_limit(1);
    CHECK_FALSE(credits.available());
    credits.clear();
    CHECK(credits.available());
}

TEST_CASE("a server that owes nothing tells which leases were lost, with their answer or on their way") {
    Credits credits(4);
    for (const std::uint64_t lease : {3, 5, 6, 8}) credits.take(LeaseId{lease}, TimeNs(10 * lease), 1000);
    CHECK(credits.settle_lost(LeaseId{2}, 30).empty());  // None of them can have been missed yet.
    CHECK(credits.settle_lost(LeaseId{5}, 30) ==
          std::vector{LeaseId{3}, LeaseId{5}});                             // Answered, not heard.
    CHECK(credits.settle_lost(LeaseId{5}, 61) == std::vector{LeaseId{6}});  // Sent long ago.
    CHECK(credits.owed() == 1);
}
