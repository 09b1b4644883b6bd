/// What must hold after every event, and at the end: simulated_cluster.hpp.

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/cluster/credit_policy.hpp"

#include "simulated_processes.hpp"

namespace pathscope::testing {
namespace {

/// Without progress though someone could work. Leases that are lost time out one after the other, each later.
constexpr TimeNs k_longest_wait = 150 * k_second_ns;
constexpr std::uint64_t k_most_at_once = 100'000;  ///< Events within a millisecond; more, and somebody spins.

}  // namespace

void SimulatedCluster::fail(std::string why) {
    if (failure_.empty()) failure_ = fmt::format("at {:.6f} s: {}", to_seconds(time_.now()), why);
}

bool SimulatedCluster::done() const {
    return client_->machine().complete() && settings_.new_states == 0 && settings_.restarts == 0;
}

bool SimulatedCluster::may_serve(const Server& server) const {
    return (settings_.relaxed && server.relay() == k_no_relay) || !server.differs();
}

/// Whether messages get through, over all relays in between.
bool SimulatedCluster::can_be_reached(const Dialler& dialler) const {
    if (!dialler.runs() || dialler.frozen() || dialler.parted() || dialler.draining()) return false;
    return dialler.relay() == k_no_relay || can_be_reached(*relays_[std::size_t(dialler.relay())]);
}

/// At the end, when all that live can be reached.
bool SimulatedCluster::stands_for_somebody(int relay) const {
    return std::any_of(servers_.begin(), servers_.end(),
                       [&](const auto& server) {
                           return server->relay() == relay && server->runs() && !server->draining() &&
                                  may_serve(*server);
                       }) ||
           std::any_of(relays_.begin(), relays_.end(), [&](const auto& other) {
               return other->relay() == relay && stands_for_somebody(other->number());
           });
}

bool SimulatedCluster::someone_can_work() const {
    if (client_->frozen()) return false;
    // A client that waits for servers works as soon as one is there; the others carry on alone.
    const bool waits = client_->machine().progress().waiting;
    return !waits || std::any_of(servers_.begin(), servers_.end(), [this](const auto& server) {
        return can_be_reached(*server) && may_serve(*server);
    });
}

void SimulatedCluster::check_all() {
    const FrameWork& work = client_->machine().work();
    if (const auto sound = work.indirect_ledger().check_invariants(); !sound) fail(sound.error().message);
    for (const auto& server : servers_) {
        check_dialler(*server);
        if (server->machine().welcomed() && !may_serve(*server)) fail("a server of other bits was admitted");
    }
    for (const auto& relay : relays_) {
        check_dialler(*relay);
        if (const auto sound = relay->relay_machine().work().check_invariants(); !sound)
            fail(sound.error().message);
        if (relay->relay_machine().work().leases() > k_most_credits) fail("a relay holds too many leases");
    }
    // A relay whose servers have all fallen silent is stuck, until it finds out.
    if (totals_.hangs == 0 && relays_.empty() && client_->store().total(Counter::stuck) > 0)
        fail("an honest server is called stuck");
    check_progress();
}

void SimulatedCluster::check_dialler(const Dialler& dialler) {
    const ServerMachine& machine = dialler.machine();
    totals_.most_leases = std::max<std::uint64_t>(totals_.most_leases, machine.leases());
    if (machine.leases() > k_most_credits || machine.unsent_answers() > 2 * k_most_credits)
        fail(fmt::format("{} holds {} leases and {} unsent answers", dialler.name(), machine.leases(),
                         machine.unsent_answers()));
}

/// A timer that is always due is a process that takes a core and does nothing.
void SimulatedCluster::check_pace() {
    if (time_.now() / k_millisecond_ns != millisecond_) {
        millisecond_ = time_.now() / k_millisecond_ns;
        events_before_ = totals_.events;
    }
    if (totals_.events - events_before_ > k_most_at_once) fail("somebody's timer is due again and again");
}

void SimulatedCluster::check_progress() {
    const std::uint64_t committed = client_->machine().work().indirect_ledger().rounds_committed();
    const bool moved = std::exchange(committed_, committed) != committed;
    if (moved && always_honest()) check_light();
    if (moved || done() || client_->machine().complete() || !someone_can_work() || !calm())
        last_progress_ = time_.now();
    if (time_.now() - last_progress_ > k_longest_wait)
        fail(fmt::format("no round was committed for {:.0f} s though somebody could work; {} of {} are",
                         to_seconds(k_longest_wait), committed,
                         client_->machine().work().indirect_ledger().rounds()));
}

/// The indirect light so far is that of the rounds that are committed, and of no other state.
void SimulatedCluster::check_light() {
    const FrameWork& work = client_->machine().work();
    const Ledger& ledger = work.indirect_ledger();
    const std::uint32_t seed = client_->machine().state().settings.seed;
    for (std::uint32_t unit = 0; unit < ledger.plan().units; ++unit) {
        const UnitSnapshot committed = ledger.snapshot(unit);
        const PixelRect rect = work.rect_of(unit);
        PixelSum expected;  // Of the block's first pixel: a round has all of its pixels or none.
        for (std::uint32_t round = 0; round < committed.reached; ++round) {
            if (std::binary_search(committed.missing.begin(), committed.missing.end(), round)) continue;
            const SampleRange samples = samples_of_round(ledger.plan(), {unit, round});
            for (std::uint32_t s = samples.first; s < samples.first + samples.count; ++s)
                expected += light_of(seed, LightPart::indirect, rect.x, rect.y, s);
        }
        if (work.indirect().sum_at(rect.x, rect.y) != expected)
            return fail(fmt::format("the light of block {} is not that of its committed rounds", unit));
    }
}

void SimulatedCluster::check_picture(LightPart part, const FrameSums& sums, std::uint32_t spp) {
    const RenderSettings& settings = client_->machine().state().settings;
    for (int y = 0; y < settings.height; ++y)
        for (int x = 0; x < settings.width; ++x) {
            PixelSum expected;
            for (std::uint32_t s = 0; s < spp; ++s) expected += light_of(settings.seed, part, x, y, s);
            if (sums.sum_at(x, y) != expected)
                return fail(fmt::format("{} light of pixel ({}, {}) is not that of its samples",
                                        name_of(part), x, y));
        }
}

/// What is counted is what is in the picture, once: also where light was taken back.
void SimulatedCluster::check_accounts() {
    const EventStore& store = client_->store();
    const RenderSettings& settings = client_->machine().state().settings;
    const auto pixels = std::uint64_t(settings.width) * std::uint64_t(settings.height);
    std::uint64_t of_servers = 0;
    for (const ServerSummary& server : store.servers()) of_servers += server.total(Counter::samples);
    const std::uint64_t samples = store.total(Counter::samples);
    if (client_->machine().epoch().value == 1 && samples != pixels * (settings.spp + settings.direct_spp))
        fail(fmt::format("{} samples are counted, not {}", samples,
                         pixels * (settings.spp + settings.direct_spp)));
    if (samples != of_servers || store.total(Counter::rays) != 3 * samples)
        fail("the counters of the servers do not add up to the totals");
}

void SimulatedCluster::check_end() {
    if (!done()) {
        if (!someone_can_work()) return;  // Nobody was left, and the client was told to wait for somebody.
        return fail(fmt::format("the frame is not complete: {} of {} rounds, {} leases are out",
                                client_->machine().work().indirect_ledger().rounds_committed(),
                                client_->machine().work().indirect_ledger().rounds(),
                                client_->machine().work().indirect_ledger().outstanding()));
    }
    const ClientMachine& machine = client_->machine();
    if (honest_at_the_end())
        check_picture(LightPart::indirect, machine.work().indirect(), machine.state().settings.spp);
    check_accounts();
    check_picture(LightPart::direct, machine.work().direct(), machine.state().settings.direct_spp);
    const Digest wanted = state_hash(machine.state());
    int alive = 0;
    for (const auto& server : servers_)
        if (server->runs() && !server->draining()) {
            if (!may_serve(*server)) fail("a server of other bits goes on though it was refused");
            alive += server->relay() == k_no_relay;
            if (server->machine().working_on() != wanted)
                fail(fmt::format("{} does not hold the client's state at the end", server->name()));
        }
    for (const auto& relay : relays_) {
        const bool works = stands_for_somebody(relay->number());
        alive += works && relay->relay() == k_no_relay;
        totals_.relayed += relay->relay_machine().work().rounds_committed();
        if (relay->machine().working_on() != (works ? std::optional(wanted) : std::nullopt))
            fail(fmt::format("{} {} the client's state at the end", relay->name(),
                             works ? "does not hold" : "stands for nobody and holds"));
    }
    if (machine.progress().servers_ready != alive)
        fail(fmt::format("{} servers are alive at the end, and the client would give work to {}", alive,
                         machine.progress().servers_ready));
    check_marks();
}

/// The image is marked if, and only if, a round of a server of other bits is in it.
void SimulatedCluster::check_marks() {
    std::uint64_t rounds = 0;
    for (const auto& server : servers_)
        if (server->differs()) {
            totals_.refused_bits += server->machine().refusal().has_value();
            rounds += client_->rounds_of(server->name());
        }
    const std::uint64_t marked = client_->machine().differing_rounds();
    totals_.marked_images += marked > 0;
    if (!settings_.relaxed && rounds > 0) fail("a round of a server of other bits was taken");
    const bool one_state = client_->machine().epoch() == Epoch{1};
    if (marked > rounds || (one_state && marked != rounds))
        fail(fmt::format("{} rounds are marked, and {} came from servers of other bits", marked, rounds));
}

}  // namespace pathscope::testing
