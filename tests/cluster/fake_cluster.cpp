#include "fake_cluster.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pathscope::testing {
namespace {

constexpr TimeNs k_beat = 250 * k_millisecond_ns;
constexpr TimeNs k_tick = 20 * k_millisecond_ns;
constexpr TimeNs k_epilogue = 30 * k_second_ns;  ///< After the end: late results still come.

// Without progress though someone could work: a frozen or dead server is found, and its work is done by
// another. When messages are lost, several leases may have to time out one after the other.
constexpr TimeNs k_longest_wait = 45 * k_second_ns;
constexpr TimeNs k_longest_wait_lossy = 900 * k_second_ns;
constexpr TimeNs k_longest_run = 20'000 * k_second_ns;

}  // namespace

ClusterSettings ClusterSettings::from_seed(std::uint32_t seed) {
    HashRng rng(seed);
    const auto below = [&](std::uint32_t n) { return rng.next_u32() % n; };
    ClusterSettings s;
    s.seed = seed;
    s.servers = below(10) == 0 ? 1 + below(64) : 1 + below(8);
    s.most_servers = s.servers + below(8);
    s.units = 1 + below(30);
    s.samples = 1 + below(24);
    s.round_samples = 1 + below(6);
    s.schedule = k_schedule_names[below(k_schedule_names.size())].value;
    s.detector = below(4) == 0 ? DetectorKind::fixed : DetectorKind::adaptive;
    s.drop = below(2) == 0 ? 0 : 0.3f * rng.next_float();
    s.duplicate = below(2) == 0 ? 0 : 0.3f * rng.next_float();
    s.refuse = below(3) == 0 ? 0.1f : 0;
    s.lie = below(3) == 0 ? 0.3f : 0;
    s.careless = below(3) == 0 ? 0.1f : 0;
    s.faults_per_second = below(3) == 0 ? 0 : 2.0 * rng.next_float();
    s.local_fallback = below(2) == 0;
    s.new_images = static_cast<int>(below(3));
    s.crashes = below(4) == 0 ? 1 : 0;
    s.stop_at = below(5) == 0 ? from_seconds(1 + 10 * rng.next_float()) : 0;
    s.most_rounds = below(2) == 0 ? 1 : 1 + below(8);
    return s;
}

std::string ClusterSettings::describe() const {
    return fmt::format(
        "{} servers, {} units x {} samples in rounds of {}, leases of up to {}, {}, {}, drop {:.2f}, "
        "duplicate {:.2f}, refuse "
        "{:.2f}, "
        "lie {:.2f}, careless {:.2f}, {:.1f} faults/s, {} images, {} crashes{}{}",
        servers, units, samples, round_samples, most_rounds, name_of(schedule), name_of(detector), drop,
        duplicate, refuse, lie, careless, faults_per_second, new_images + 1, crashes,
        local_fallback ? ", local fallback" : "", stop_at > 0 ? ", open-ended" : "");
}

FakeCluster::FakeCluster(const ClusterSettings& settings)
    : settings_(settings),
      rng_(hash_u32(settings.seed) ^ 0x5eedu),
      schedule_(settings.schedule, make_unit_order(UnitOrder::spiral, settings.units, 1)) {}

std::string FakeCluster::run() {
    begin_image();
    for (std::uint32_t i = 0; i < settings_.servers; ++i) start_process();
    at(k_tick, [this] { tick(); });
    plan_faults();

    // Ends a while after the work does, so that what is still under way arrives.
    TimeNs end = k_longest_run;
    while (!happenings_.empty() && happenings_.top().first.first <= end && failure_.empty()) {
        const std::function<void()> happens = happenings_.top().second;
        now_ = happenings_.top().first.first;
        happenings_.pop();
        happens();
        ++totals_.events;
        check_all();
        const bool done = ledger_.complete() && settings_.new_images == 0 && settings_.crashes == 0;
        if (done && end == k_longest_run) end = now_ + k_epilogue;
    }
    if (failure_.empty()) check_end();
    totals_.virtual_time = now_;
    totals_.ledger = ledger_.counts();
    return failure_;
}

// -- The world ----------------------------------------------------------------------------------------------

void FakeCluster::at(TimeNs when, std::function<void()> happens) {
    happenings_.push({{when, ++order_}, std::move(happens)});
}

void FakeCluster::send(std::function<void()> arrives) {
    const int copies = chance(settings_.drop) ? 0 : chance(settings_.duplicate) ? 2 : 1;
    // Mostly a millisecond, at times much longer: messages overtake each other.
    for (int i = 0; i < copies; ++i) at(now_ + k_millisecond_ns + soon(chance(0.05) ? 1.0 : 0.005), arrives);
}

void FakeCluster::plan_faults() {
    for (int i = 0; i < settings_.new_images; ++i)
        at(soon(6), [this] {
            --settings_.new_images;
            begin_image();
        });
    for (int i = 0; i < settings_.crashes; ++i)
        at(soon(6), [this] {
            --settings_.crashes;
            crash_and_resume();
        });
    if (settings_.stop_at > 0) at(settings_.stop_at, [this] { ledger_.stop(); });
    if (settings_.faults_per_second > 0) at(soon(2), [this] { strike(); });
}

void FakeCluster::strike() {
    at(now_ + from_seconds(-std::log(1 - uniform()) / settings_.faults_per_second), [this] { strike(); });
    if (chance(0.3) && processes_.size() < settings_.most_servers) return start_process();
    const std::size_t p = rng_.next_u32() % processes_.size();
    if (chance(0.4)) {
        processes_[p].frozen_until = now_ + soon(10);
        return;
    }
    if (p == 0 && !settings_.local_fallback) return;  // somebody has to be left
    if (chance(0.5))
        processes_[p].running = false;
    else
        leave(p);
}

// -- Servers ------------------------------------------------------------------------------------------------

void FakeCluster::start_process() {
    processes_.push_back({});
    processes_.back().samples_per_second = 20 * std::exp(1.0 * (uniform() - 0.5) * 4);  // 2.7 .. 148
    const std::size_t p = processes_.size() - 1;
    at(now_ + soon(0.5), [this, p] { beat(p); });
}

// A beat every quarter of a second; without an id, the beat is a HELLO.
void FakeCluster::beat(std::size_t p) {
    Process& process = processes_[p];
    if (!process.running) return;
    if (now_ < process.frozen_until) return at(process.frozen_until, [this, p] { beat(p); });
    at(now_ + k_beat, [this, p] { beat(p); });
    if (process.id == ServerId{})
        send([this, p] { on_hello(p); });
    else
        send([this, p, id = process.id] { on_beat(p, id); });
}

void FakeCluster::take(std::size_t p, const Lease& lease, std::uint32_t image) {
    Process& process = processes_[p];
    if (!process.running) return;
    if (chance(settings_.refuse)) return send([this, lease] { on_refusal(lease.server, lease.id); });
    process.queue.emplace_back(lease, image);
    compute(p);
}

void FakeCluster::compute(std::size_t p) {
    Process& process = processes_[p];
    if (process.busy || process.queue.empty()) return;
    process.busy = true;
    const auto [lease, image] = process.queue.front();
    process.queue.pop_front();
    const TimeNs took = from_seconds(lease.count / process.samples_per_second * (0.5 + uniform()));
    at(now_ + took, [this, p, lease = lease, image = image, took] { finish(p, lease, image, took); });
}

void FakeCluster::finish(std::size_t p, const Lease& lease, std::uint32_t image, TimeNs took) {
    Process& process = processes_[p];
    if (!process.running) return;
    if (now_ < process.frozen_until)
        return at(process.frozen_until, [this, p, lease, image, took] { finish(p, lease, image, took); });
    const Result honest{
        {lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server}, image, took};
    send([this, honest] { on_result(honest); });
    if (chance(settings_.lie)) {
        Result forged = honest;
        switch (rng_.next_u32() % 6) {
            case 0:
                forged.claim.unit = rng_.next_u32() % (settings_.units + 2);
                break;
            case 1:
                forged.claim.first += settings_.round_samples;
                break;
            case 2:
                forged.claim.count ^= 1u;
                break;
            case 3:
                forged.claim.lease.value = rng_.next_u32() % (ledger_.counts().granted + 3);
                break;
            case 4:
                forged.claim.epoch.value += rng_.next_u32() % 3 - 1;
                break;
            default:
                forged.claim.server.value ^= 1u;
                break;
        }
        if (forged.claim != honest.claim) {
            // Light of no image at all: must never be merged. But under the name of another of its leases on the
            // same round, the light is the right one.
            ResultClaim renamed = forged.claim;
            renamed.lease = honest.claim.lease;
            if (renamed != honest.claim) forged.image = ~0u;
            send([this, forged] { on_result(forged); });
        }
    }
    process.busy = false;
    compute(p);
}

void FakeCluster::leave(std::size_t p) {
    if (!processes_[p].running) return;
    processes_[p].running = false;
    send([this, id = processes_[p].id] { on_good_bye(id); });
}

// -- The client ---------------------------------------------------------------------------------------------

void FakeCluster::on_hello(std::size_t p) {
    Process& process = processes_[p];
    if (process.joining || process.id != ServerId{}) return;  // HELLO repeated
    process.joining = true;
    const ServerId id{++last_server_};
    Seat seat{
        Peer(id, now_), Credits(1 + rng_.next_u32() % 3), FailureDetector(settings_.detector, now_), {}, p};
    seat.peer.apply(PeerCause::welcomed, now_);
    seats_.emplace(id, seat);
    // WELCOME and the state travel, the server answers READY. It is told again until it has it.
    at(now_ + soon(0.4), [this, p, id] {
        processes_[p].id = id;
        processes_[p].joining = false;
        const auto found = seats_.find(id);
        if (found == seats_.end() || found->second.peer.apply(PeerCause::synced, now_) == nullptr) return;
        tell_schedule();
        hand_out();
    });
}

void FakeCluster::on_beat(std::size_t p, ServerId id) {
    const auto found = seats_.find(id);
    if (found != seats_.end()) return found->second.detector.on_heartbeat(now_);
    // WHO: it was given up. It has to say HELLO again, and is somebody new.
    if (processes_[p].id == id) processes_[p].id = {};
}

void FakeCluster::on_result(const Result& result) {
    const Verdict judged = ledger_.judge(result.claim);
    const Commit commit = ledger_.commit(result.claim, now_);
    if (judged != commit.verdict) fail("judge and commit differ");
    if (commit.verdict == Verdict::accepted) merge(result);
    const auto found = seats_.find(result.claim.server);
    if (found == seats_.end()) return;
    Seat& seat = found->second;
    seat.credits.settle(result.claim.lease);
    seat.detector.on_traffic(now_);
    if (commit.verdict == Verdict::accepted) seat.speed.add(result.claim.count, result.took);
    hand_out_to(found->first, seat);
}

void FakeCluster::on_refusal(ServerId id, LeaseId lease) {
    ledger_.release(lease, id, now_);
    if (const auto found = seats_.find(id); found != seats_.end()) found->second.credits.settle(lease);
}

void FakeCluster::on_good_bye(ServerId id) {
    if (const auto found = seats_.find(id); found != seats_.end()) {
        found->second.peer.apply(PeerCause::left, now_);
        lose(id);
    }
}

void FakeCluster::lose(ServerId id) {
    seats_.erase(id);
    ledger_.revoke(id, now_);
    if (ledger_.outstanding(id) != 0) fail("a lost server still holds leases");
    tell_schedule();
}

void FakeCluster::tick() {
    at(now_ + k_tick, [this] { tick(); });
    std::vector<ServerId> dead;
    for (auto& [id, seat] : seats_) {
        const PeerTransition* const step = seat.peer.apply(seat.detector.assess(now_).state, now_);
        if (step != nullptr && step->to == PeerState::dead) dead.push_back(id);
        seat.credits.write_off(now_);
    }
    for (const ServerId id : dead) {
        const Process& process = processes_[seats_.at(id).process];
        ++totals_.deaths;
        totals_.false_deaths += process.running && now_ >= process.frozen_until ? 1 : 0;
        lose(id);
    }
    ledger_.expire(now_);
    if (ledger_.next_deadline() && *ledger_.next_deadline() <= now_) fail("a lease outlived its deadline");
    grant_carelessly();
    hand_out();
}

void FakeCluster::hand_out() {
    for (auto& [id, seat] : seats_) hand_out_to(id, seat);
    work_locally();
}

void FakeCluster::hand_out_to(ServerId id, Seat& seat) {
    while (seat.peer.accepts_work() && seat.credits.available()) {
        const std::uint32_t most = 1 + rng_.next_u32() % settings_.most_rounds;
        const std::optional<TimeNs> each = seat.speed.predict(settings_.round_samples * most);
        const auto predicted = each ? std::optional(*each * TimeNs(1 + seat.credits.owed())) : std::nullopt;
        std::optional<Lease> lease;
        if (const auto round = schedule_.pick(ledger_, id)) {
            lease = ledger_.grant(id, ledger_.grantable(*round, most), now_,
                                  lease_duration(predicted, ledger_.attempts(*round)));
            if (!lease) fail("the schedule proposed a round that is not open");
        } else if (predicted) {
            const auto own = [&](const Lease& late) { return seat.speed.predict(late.count); };
            if (const auto late = pick_straggler(ledger_, id, now_, own)) {
                const RoundKey first = ledger_.rounds_of(*late).first;
                lease =
                    ledger_.grant_copy(id, first, now_, lease_duration(predicted, ledger_.attempts(first)));
            }
        }
        if (!lease) return;
        seat.credits.take(lease->id, now_, lease->deadline + (lease->deadline - lease->granted));
        send([this, p = seat.process, lease = *lease, image = image_] { take(p, lease, image); });
    }
}

// A schedule may be wrong: the ledger must not believe it. What it does grant goes nowhere, and expires.
void FakeCluster::grant_carelessly() {
    if (!chance(settings_.careless) || seats_.empty()) return;
    const LedgerPlan& plan = ledger_.plan();
    const RoundKey round{rng_.next_u32() % plan.units,
                         rng_.next_u32() % std::min(8u, plan.rounds_per_unit())};
    const std::uint32_t first = round.index * plan.round_samples;
    const std::vector<Lease> held = ledger_.outstanding_leases();
    const bool is_held = std::any_of(held.begin(), held.end(), [&](const Lease& lease) {
        return lease.unit == round.unit && first - lease.first < lease.count;
    });
    const bool is_merged = merged_[round.unit].contains(first);
    if (ledger_.grant(seats_.begin()->first, round, now_, k_second_ns) &&
        (is_held || is_merged || ledger_.stopped()))
        fail(fmt::format("granted round {} of unit {}, which is not open", round.index, round.unit));
}

// The client's own renderer: works while no server is ready.
void FakeCluster::work_locally() {
    if (!settings_.local_fallback || local_busy_) return;
    const auto round = schedule_.pick(ledger_, k_local_server);
    if (!round) return;
    const auto lease =
        ledger_.grant(k_local_server, *round, now_, lease_duration(std::nullopt, ledger_.attempts(*round)));
    if (!lease) return fail("the schedule proposed a round that is not open");
    local_busy_ = true;
    const Result result{
        {lease->id, lease->epoch, lease->unit, lease->first, lease->count, k_local_server}, image_, 0};
    at(now_ + soon(0.3), [this, result] {
        local_busy_ = false;
        on_result(result);
        work_locally();
    });
}

void FakeCluster::tell_schedule() {
    std::vector<ServerShare> alive;
    for (const auto& [id, seat] : seats_)
        if (seat.peer.state() == PeerState::ready || seat.peer.state() == PeerState::suspect)
            alive.push_back({id, seat.speed.per_second()});
    if (alive.empty() && settings_.local_fallback) alive.push_back({k_local_server, 0});
    schedule_.set_servers(std::move(alive));
}

void FakeCluster::begin_image() {
    ++image_;
    ++epoch_;
    merged_.clear();
    const std::uint32_t samples = settings_.stop_at > 0 ? k_open_ended : settings_.samples;
    ledger_.new_epoch({Epoch{epoch_}, settings_.units, samples, settings_.round_samples}, now_);
    // Open-ended work that the stop came before would never end.
    if (settings_.stop_at > 0 && now_ >= settings_.stop_at) ledger_.stop();
    for (auto& [id, seat] : seats_) seat.credits.clear();
    last_progress_ = now_;
    tell_schedule();
}

// The new client has the checkpoint and nothing else: it knows no server, and no lease.
void FakeCluster::crash_and_resume() {
    std::vector<UnitSnapshot> checkpoint;
    for (std::uint32_t unit = 0; unit < settings_.units; ++unit) checkpoint.push_back(ledger_.snapshot(unit));
    const LedgerPlan plan = ledger_.plan();
    const bool stopped = ledger_.stopped();
    ledger_ = Ledger(&store_);
    ledger_.new_epoch({Epoch{++epoch_}, plan.units, plan.samples, plan.round_samples}, now_);
    for (std::uint32_t unit = 0; unit < settings_.units; ++unit)
        if (const auto restored = ledger_.restore(unit, checkpoint[unit]); !restored)
            fail(restored.error().message);
    if (stopped) ledger_.stop();
    seats_.clear();
    last_progress_ = now_;
    tell_schedule();
}

// -- The oracle ---------------------------------------------------------------------------------------------

void FakeCluster::merge(const Result& result) {
    const ResultClaim& claim = result.claim;
    last_progress_ = now_;
    if (result.image != image_)
        return fail(fmt::format("merged a result of image {} into image {}", result.image, image_));
    for (std::uint32_t first = claim.first; first < claim.first + claim.count;
         first += settings_.round_samples)
        if (!merged_[claim.unit].insert(first).second)
            return fail(fmt::format("merged samples {} of unit {} twice", first, claim.unit));
}

void FakeCluster::fail(std::string why) {
    if (failure_.empty()) failure_ = fmt::format("at {:.6f} s: {}", to_seconds(now_), why);
}

// The audit walks all records, so that large clusters have it done for a part of the events.
void FakeCluster::check_all() {
    check_progress();
    if (processes_.size() > 12 && totals_.events % 16 != 0) return;
    ++totals_.audits;
    if (const auto sound = ledger_.check_invariants(); !sound) fail(sound.error().message);
    std::uint64_t merged = 0;
    for (const auto& [unit, firsts] : merged_) merged += firsts.size();
    if (merged != ledger_.rounds_committed())
        fail(fmt::format("{} rounds are merged, {} in the account", merged, ledger_.rounds_committed()));
}

bool FakeCluster::someone_can_work() const {
    if (settings_.local_fallback) return true;
    return std::any_of(processes_.begin(), processes_.end(), [&](const Process& process) {
        return process.running && now_ >= process.frozen_until;
    });
}

void FakeCluster::check_progress() {
    if (ledger_.complete() || !someone_can_work()) last_progress_ = now_;
    const TimeNs longest = settings_.drop > 0 ? k_longest_wait_lossy : k_longest_wait;
    if (now_ - last_progress_ > longest)
        fail(fmt::format("no progress for {} s, {} of {} rounds committed", longest / k_second_ns,
                         ledger_.rounds_committed(), ledger_.rounds()));
}

void FakeCluster::check_end() {
    if (!ledger_.complete()) return fail("never done");
    if (settings_.stop_at > 0) {
        for (std::uint32_t unit = 0; unit < settings_.units; ++unit)
            if (ledger_.samples_committed(unit) != merged_[unit].size() * settings_.round_samples)
                fail(fmt::format("unit {} has {} samples, {} rounds merged", unit,
                                 ledger_.samples_committed(unit), merged_[unit].size()));
        return;
    }
    std::set<std::uint32_t> whole;
    for (std::uint32_t first = 0; first < settings_.samples; first += settings_.round_samples)
        whole.insert(first);
    for (std::uint32_t unit = 0; unit < settings_.units; ++unit)
        if (merged_[unit] != whole)
            fail(fmt::format("unit {} ends with {} of {} rounds", unit, merged_[unit].size(), whole.size()));
}

}  // namespace pathscope::testing
