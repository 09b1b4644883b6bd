/// The client of a frame among servers that say anything at any time: its account stays in balance, and its image holds
/// exactly the results that were accepted.
///
///     bytes = settings *step          ; a step is one of k_steps and what that step reads
///
/// What the client sends must be a message that a server decodes. Every round that it begins has one outcome.

#include <set>

#include "../session/simulated_renderer.hpp"
#include "forged_message.hpp"
#include "fuzz_target.hpp"
#include "honest_tile.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/session/admission.hpp"
#include "pathscope/session/client_machine.hpp"
#include "small_states.hpp"

namespace pathscope::fuzz {
namespace {

constexpr std::uint64_t k_session = 77;
constexpr std::size_t k_peers = 4;
constexpr int k_block = 4;
constexpr int k_most_steps = 200;
constexpr std::size_t k_most_kept = 64;  ///< Leases that the script may still answer.
constexpr std::array<TimeNs, 8> k_pauses{
    0,           1'000,           k_millisecond_ns, 60 * k_millisecond_ns, 250 * k_millisecond_ns,
    k_second_ns, 7 * k_second_ns, 100 * k_second_ns};

std::string instance_of(std::size_t peer) { return std::string(15, 'i') + char('0' + peer); }

class ClientScript : private ClientWorld {
  public:
    explicit ClientScript(std::string_view bytes)
        : in_(bytes),
          store_(in_.flag() ? ProbeLevel::full : ProbeLevel::counters),
          machine_(config(), {small_state(0), nullptr, SceneDepot()}, k_session, store_, *this, now_) {
        begin_pictures();
    }

    void run() {
        for (int step = 0; step < k_most_steps && !in_.empty(); ++step) {
            (this->*k_steps[in_.below(k_steps.size())])();
            machine_.on_timers(now_);
            const auto sound = machine_.work().indirect_ledger().check_invariants();
            CHECK(bool(sound), sound.error().message);
            CHECK(machine_.next_timer(now_) >= now_, now_);
        }
        check_picture(machine_.work().indirect(), indirect_);
        check_picture(machine_.work().direct(), direct_);
        const Progress progress = machine_.progress();
        CHECK(progress.indirect >= 0 && progress.indirect <= 1, progress.indirect);
    }

  private:
    using Picture = std::vector<PixelSum>;
    struct SentLease {
        std::size_t peer;
        message::Lease lease;
    };
    struct BegunRound {
        RoundJob job;
        Epoch epoch;
    };

    ClientConfig config() {
        ClientConfig config;
        config.listens = in_.flag();
        config.block_size = k_block;
        config.round_samples = 1 + std::uint32_t(in_.below(3));
        config.schedule = k_schedule_names[in_.below(k_schedule_names.size())].value;
        config.detector = in_.flag() ? DetectorKind::fixed : DetectorKind::adaptive;
        config.min_servers = in_.below(4) == 3 ? 1 : 0;
        config.time_limit = in_.below(8) == 7 ? 3 * k_second_ns : 0;
        return config;
    }

    // ---- The world.

    bool send(Channel channel, const std::string& instance, Frames frames) override {
        Decoded decoded = decode(std::move(frames), Role::server, channel);
        CHECK(bool(decoded), decoded.error().sentence);
        if (const auto* lease = std::get_if<message::Lease>(&*decoded)) {
            const auto peer = std::size_t(instance.back() - '0');
            if (leases_.size() < k_most_kept) leases_.push_back({peer, *lease});
            if (reachable_) received_.at(peer) = std::max(received_.at(peer), lease->lease);
        }
        return reachable_;
    }
    void publish(Frames frames) override {
        const Decoded decoded = decode(std::move(frames), Role::server, Channel::input);
        CHECK(bool(decoded), decoded.error().sentence);
    }
    void begin(RoundJob job) override { rounds_.push_back({std::move(job), machine_.epoch()}); }
    void cancel_all() override {}

    // ---- The oracle.

    void begin_pictures() {
        const RenderSettings& settings = machine_.state().settings;
        indirect_.assign(std::size_t(settings.width) * std::size_t(settings.height), {});
        direct_ = indirect_;
    }
    void add(Picture& picture, const PixelRect& rect, const std::vector<PixelSum>& sums) {
        const auto width = std::size_t(machine_.state().settings.width);
        CHECK(sums.size() == std::size_t(rect.area()), sums.size());
        for (std::size_t i = 0; i < sums.size(); ++i)
            picture[(std::size_t(rect.y) + i / std::size_t(rect.width)) * width + std::size_t(rect.x) +
                    i % std::size_t(rect.width)] += sums[i];
    }
    static void check_picture(const FrameSums& sums, const Picture& expected) {
        const int width = sums.grid().width();
        for (std::size_t i = 0; i < expected.size(); ++i) {
            const int x = int(i) % width, y = int(i) / width;
            CHECK(sums.sum_at(x, y) == expected[i], x, y);
        }
    }
    [[nodiscard]] std::uint64_t accepted() const {
        return machine_.work().indirect_ledger().counts().accepted;
    }

    void deliver(std::size_t peer, Channel channel, const Frames& frames) {
        const std::uint64_t before = accepted();
        machine_.on_message(instance_of(peer), frames, channel, now_);
        if (accepted() == before) return;
        CHECK(accepted() == before + 1, accepted(), before);
        Decoded decoded = decode(frames, Role::client, channel);
        CHECK(bool(decoded) && std::holds_alternative<message::Tile>(*decoded));
        auto& tile = *std::get_if<message::Tile>(&*decoded);
        const PixelRect rect = machine_.work().rect_of(tile.unit);
        const auto sums = block_result(tile, rect.area(), machine_.state().settings.wire);
        CHECK(bool(sums), sums.error().message);
        add(indirect_, rect, *sums);
    }
    void say(std::size_t peer, Message message) {
        const Channel channel = k_message_table[message.index()].channel;
        deliver(peer, channel, encode(std::move(message)));
    }

    // ---- Steps.

    void wait() { now_ += k_pauses[in_.below(k_pauses.size())]; }
    void hello() {
        const std::size_t peer = in_.below(k_peers);
        say(peer, message::Hello{instance_of(peer), "peer", "0", own_bits().build, 1, in_.byte(),
                                 own_bits().golden});
    }
    void ready() { say_ready(in_.below(k_peers)); }
    /// It holds the state and asks for work.
    void say_ready(std::size_t peer) {
        say(peer, message::Ready{k_session, machine_.epoch(), 0, state_hash(machine_.state())});
        say(peer, message::Credit{k_session, 2, received_.at(peer)});
    }
    /// What an honest server says.
    void join() {
        const std::size_t peer = in_.below(k_peers);
        say(peer, message::Hello{instance_of(peer), "peer", "0", own_bits().build, 1, 1, own_bits().golden});
        say_ready(peer);
    }

    [[nodiscard]] message::Tile tile_of(const message::Lease& lease) const {
        const RenderSettings& settings = machine_.state().settings;
        return honest_tile(lease, settings.seed, settings.wire);
    }
    void tile() {
        if (leases_.empty()) return;
        const std::size_t pick = in_.below(leases_.size());
        const SentLease lease = leases_[pick];
        if (in_.flag()) leases_.erase(leases_.begin() + std::ptrdiff_t(pick));  // Else it may come twice.
        say(lease.peer, tile_of(lease.lease));
    }
    /// A tile of which one thing is not as it should be.
    void wrong_tile() {
        if (leases_.empty()) return;
        const SentLease sent = leases_[in_.below(leases_.size())];
        message::Tile tile = tile_of(sent.lease);
        std::size_t peer = sent.peer;
        switch (in_.below(13)) {
            case 0:
                peer = in_.below(k_peers);
                break;
            case 1:
                tile.lease.value = std::max<std::uint64_t>(1, in_.number());
                break;
            case 2:
                tile.epoch.value = std::uint32_t(in_.number());
                break;
            case 3:
                tile.unit = std::uint32_t(in_.number());
                break;
            case 4:
                tile.first = std::uint32_t(std::min<std::uint64_t>(in_.number(), k_max_samples_per_pixel));
                break;
            case 5:
                tile.count =
                    std::uint32_t(std::clamp<std::uint64_t>(in_.number(), 1, k_max_samples_per_pixel));
                break;
            case 6:
                tile.session = std::max<std::uint64_t>(1, in_.number());
                break;
            case 7:
                tile.raw_bytes = std::uint32_t(std::min<std::uint64_t>(in_.number(), k_max_tile_bytes));
                break;
            case 8:
                tile.result = in_.text();
                break;
            case 9:
                tile.hash[0] ^= 1;
                break;
            case 10: {
                const auto quanta = std::int64_t(in_.number());
                const std::vector<PixelSum> sums(std::size_t(sent.lease.rect.area()), {quanta, 0, quanta});
                const WireFormat any = k_wire_format_names[in_.below(k_wire_format_names.size())].value;
                put_block_result(tile, sums, quanta < 0 ? WireFormat::exact : any);
                break;
            }
            case 11:
                tile.started_ns = TimeNs(in_.number() >> 1);
                tile.render_ns = TimeNs(in_.number() >> 1);
                break;
            default:
                tile.rays = in_.number();
                tile.samples = in_.number();
                tile.dropped_count = tile.saturated_count = std::uint32_t(in_.number());
        }
        say(peer, std::move(tile));
    }
    void nack() {
        if (leases_.empty()) return;
        const SentLease& sent = leases_[in_.below(leases_.size())];
        say(sent.peer, message::Nack{k_session, sent.lease.lease, sent.lease.epoch,
                                     k_nack_code_names[in_.below(k_nack_code_names.size())].value, "no"});
    }
    void pong() {
        const auto back = TimeNs(in_.number() >> 1), there = TimeNs(in_.number() >> 1);
        say(in_.below(k_peers), message::Pong{std::uint64_t(now_) - in_.number(), back, there, 0, 0});
    }
    void forged() {
        const std::size_t peer = in_.below(k_peers);
        const Frames frames = forged_message(in_, k_session);
        const MessageInfo* info = find_message(std::uint8_t(frames[0][3]));
        deliver(peer, info->channel == Channel::input ? Channel::monitor : info->channel, frames);
    }
    void garbage() {
        const std::size_t peer = in_.below(k_peers);
        deliver(peer, in_.flag() ? Channel::monitor : Channel::frames, raw_frames(in_));
    }
    void outcome() {
        if (rounds_.empty()) return;
        const auto pick =
            rounds_.begin() + std::ptrdiff_t(in_.below(std::min<std::size_t>(rounds_.size(), 256)));
        const BegunRound round = std::move(*pick);
        rounds_.erase(pick);
        RoundOutcome outcome;
        outcome.ticket = round.job.ticket;
        outcome.part = round.job.part;
        outcome.round = round.job.round;
        if (in_.below(4) > 0) {
            outcome.result = testing::render_by_hash(round.job, round.job.part);
            if (round.job.direct_too) outcome.direct = testing::render_by_hash(round.job, LightPart::direct);
        }
        const std::uint64_t before = accepted();
        machine_.on_outcome(outcome, now_);
        if (!outcome.result) return CHECK(accepted() == before, before);
        const PixelRect& rect = round.job.round.rect;
        if (accepted() > before) add(indirect_, rect, outcome.result->sums);
        // Nobody else renders direct light: it counts unless its epoch has ended.
        const bool is_direct = round.job.part == LightPart::direct;
        if (round.epoch == machine_.epoch() && (is_direct || outcome.direct))
            add(direct_, rect, is_direct ? outcome.result->sums : outcome.direct->sums);
    }
    void new_state() {
        if (++new_states_ > 8) return;
        RenderState state = small_state(in_.below(k_small_states));
        state.scene = machine_.state().scene;
        state.options = machine_.state().options;
        state.settings.width = 1 + int(in_.below(20));
        machine_.change_state(std::move(state), nullptr, now_);
        begin_pictures();
    }
    void network() { reachable_ = in_.flag(); }
    void pause() {
        const TimeNs pause = k_pauses[in_.below(k_pauses.size())];
        now_ += pause;
        machine_.on_own_pause(pause);
    }
    /// Each process that was begun ends once.
    void process() {
        const std::uint32_t pid = 1 + std::uint32_t(in_.below(4));
        const auto running = processes_.find(pid);
        if (running == processes_.end()) {
            processes_.insert(pid);
            return machine_.expect_server(pid, "peer");
        }
        processes_.erase(running);
        machine_.on_process_ended(pid, "peer", "was killed", now_);
    }
    void goodbye() {
        if (in_.below(8) == 0) machine_.say_goodbye(now_);
    }

    static constexpr std::array k_steps{
        &ClientScript::wait,    &ClientScript::hello,   &ClientScript::ready,      &ClientScript::join,
        &ClientScript::tile,    &ClientScript::outcome, &ClientScript::wrong_tile, &ClientScript::nack,
        &ClientScript::pong,    &ClientScript::forged,  &ClientScript::garbage,    &ClientScript::new_state,
        &ClientScript::network, &ClientScript::pause,   &ClientScript::process,    &ClientScript::goodbye,
    };

    FuzzInput in_;
    TimeNs now_ = k_second_ns;
    bool reachable_ = true;
    int new_states_ = 0;
    std::set<std::uint32_t> processes_;
    std::vector<SentLease> leases_;
    std::array<LeaseId, k_peers> received_{};  ///< By servers, the last.
    std::vector<BegunRound> rounds_;
    EventStore store_;
    ClientMachine machine_;
    Picture indirect_, direct_;
};

void play(std::string_view bytes) { ClientScript(bytes).run(); }

std::vector<std::string> seeds() {
    using namespace std::string_literals;
    const std::string settings = "\1\1\1\0\0\0\0"s;
    std::vector<std::string> seeds;
    std::string honest = settings + "\3\0\3\1"s;  // Two servers join, and answer until all is done.
    for (int i = 0; i < 60; ++i) honest += "\4\0\1\0\2"s;
    seeds.push_back(honest);
    std::string alone = settings;  // The client renders all of it.
    for (int i = 0; i < 80; ++i) alone += "\5\0\1\0\1"s;
    seeds.push_back(alone);
    for (int kind = 0; kind < 13; ++kind)
        seeds.push_back(settings + "\3\0\3\1"s + std::string{'\6', 0, char(kind), '\xcc', '\xcf'} +
                        "\4\0\0\4\0\1\4\0\0"s);
    for (int code = 0; code < 8; ++code)
        seeds.push_back(settings + "\3\0"s + std::string{'\7', 0, char(code)} + "\0\5\4\0\1"s);
    for (int type = 0; type < 20; ++type)
        seeds.push_back(settings + "\3\0\11\0"s + std::string(1, char(type)) + std::string(40, '\5') +
                        "\0\5"s);
    seeds.push_back(settings + "\3\0\4\0\1\13\2\7\3\0\4\0\0\0\7\14\0\0\6\14\1\0\7"s);
    seeds.push_back(settings + "\3\0\10\1\2\0\5\10\xcc\xcc\0\0\4\0\1\15\6\16\1\1\16\1\0\17\0"s);
    return seeds;
}

const FuzzTarget k_target{"client", play, seeds};

}  // namespace
}  // namespace pathscope::fuzz
