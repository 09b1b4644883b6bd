/// A relay between a client and servers that both say anything at any time: each side's promises hold, and a tile that goes up
/// is the sum of its samples, each once.
///
///     bytes = settings *step          ; a step is one of k_steps and what that step reads
///
/// What it sends is a message that the other side decodes; what it holds is bounded by its credits.

#include <map>
#include <utility>

#include "../temporary_folder.hpp"
#include "forged_message.hpp"
#include "fuzz_target.hpp"
#include "honest_tile.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/session/relay_machine.hpp"
#include "small_states.hpp"

namespace pathscope::fuzz {
namespace {

constexpr std::uint64_t k_session_above = 77, k_session_below = 78;
constexpr std::size_t k_peers = 4;
constexpr int k_most_steps = 200;
constexpr std::size_t k_most_kept = 64;  ///< Leases that the script may still answer.
constexpr std::array<TimeNs, 8> k_pauses{
    0,           1'000,           k_millisecond_ns, 60 * k_millisecond_ns, 250 * k_millisecond_ns,
    k_second_ns, 7 * k_second_ns, 100 * k_second_ns};

std::string instance_of(std::size_t peer) { return std::string(15, 'i') + char('0' + peer); }

/// Empty at the beginning of each script.
const SceneCache& scene_cache() {
    static const testing::TemporaryFolder folder;
    static const SceneCache cache(folder.path());
    for (const std::string_view file : k_small_files) cache.forget(hash_text(file));
    return cache;
}

class RelayScript : private RelayWorld {
  public:
    explicit RelayScript(std::string_view bytes)
        : in_(bytes),
          relay_({"relay", "0", own_bits(), 1, 7, "client"}, scene_cache(), config(), k_session_below, store_,
                 *this) {}

    void run() {
        for (int step = 0; step < k_most_steps && !in_.empty() && !relay_.above().ended(); ++step) {
            if (!relay_.above().linked() && (relay_.wants_client(now_) || in_.below(4) == 0)) link();
            (this->*k_steps[in_.below(k_steps.size())])();
            relay_.on_timers(now_);
            const auto sound = relay_.work().check_invariants();
            CHECK(bool(sound), sound.error().message);
            CHECK(relay_.next_timer(now_) >= now_, now_);
            CHECK(relay_.work().leases() <= most_credits_, relay_.work().leases(), most_credits_);
            CHECK(relay_.above().unsent_answers() <= 2 * most_credits_ + 16, relay_.above().unsent_answers());
        }
        relay_.say_goodbye(now_);
    }

  private:
    struct SentLease {
        std::size_t peer;
        message::Lease lease;
        std::uint32_t seed;  ///< Of the state below.
    };
    struct GivenLease {
        message::Lease lease;
        std::size_t state;
        int answers_left;
    };

    ClientConfig config() {
        ClientConfig config;
        config.detector = in_.flag() ? DetectorKind::fixed : DetectorKind::adaptive;
        return config;
    }
    void link() { relay_.above().on_linked(std::string(16, char('a' + ++links_ % 26)), now_); }

    // ---- The world.

    bool send_up(Channel channel, Frames&& frames) override {
        Decoded decoded = decode(frames, Role::client, channel);
        CHECK(bool(decoded), decoded.error().sentence);
        const auto* tile = std::get_if<message::Tile>(&*decoded);
        if (tile && above_hears_) check_tile(*tile);
        return above_hears_;
    }
    bool send_down(Channel channel, const std::string& instance, Frames frames) override {
        Decoded decoded = decode(std::move(frames), Role::server, channel);
        CHECK(bool(decoded), decoded.error().sentence);
        if (const auto* lease = std::get_if<message::Lease>(&*decoded)) {
            CHECK(relay_.below() != nullptr);
            const RenderSettings& settings = relay_.below()->state().settings;
            CHECK((PixelRect{0, 0, settings.width, settings.height}.contains(lease->rect)), lease->rect);
            const std::size_t peer = std::size_t(instance.back() - '0') % k_peers;
            if (leases_.size() < k_most_kept) leases_.push_back({peer, *lease, settings.seed});
            if (below_hears_) received_[peer] = std::max(received_[peer], lease->lease);
        }
        return below_hears_;
    }
    void publish_down(Frames frames) override {
        const Decoded decoded = decode(std::move(frames), Role::server, Channel::input);
        CHECK(bool(decoded), decoded.error().sentence);
    }
    void check_scene(RenderState state, Manifest manifest) override {
        CHECK(!checking_.has_value());
        checking_.emplace(std::move(state), std::move(manifest));
    }

    // ---- The oracle.

    /// Unless a server lied, in the right form and about the right lease, which only an audit can find.
    void check_tile(const message::Tile& tile) {
        const auto given = given_.find(tile.lease.value);
        CHECK(given != given_.end(), tile.lease.value);
        const message::Lease& lease = given->second.lease;
        CHECK(given->second.answers_left-- > 0, tile.lease.value);
        CHECK(tile.unit == lease.unit && tile.first == lease.first && tile.count == lease.count, tile.unit);
        const RenderState& state = small_state(given->second.state);
        const message::Tile expected = honest_tile(lease, state.settings.seed, state.settings.wire);
        CHECK(lied_ || tile.samples == expected.samples, tile.samples);
        CHECK(lied_ || tile.hash == expected.hash, tile.unit);
    }

    // ---- What both sides say.

    void hear_above(Channel channel, Frames frames) {
        if (!relay_.above().linked()) return;
        if (Decoded decoded = decode(frames, Role::server, channel))
            if (const auto* welcome = std::get_if<message::Welcome>(&*decoded))
                most_credits_ = std::max<std::size_t>(most_credits_, welcome->credits);
        relay_.above().on_message(std::move(frames), channel, now_);
    }
    void say_above(Message message) {
        const Channel channel = k_message_table[message.index()].channel;
        hear_above(channel, encode(std::move(message)));
    }
    void hear_below(std::size_t peer, Channel channel, Frames frames, bool honest) {
        const std::uint64_t before = relay_.work().rounds_committed();
        relay_.on_message(instance_of(peer), std::move(frames), channel, now_);
        if (!honest && relay_.work().rounds_committed() > before) lied_ = true;
    }
    void say_below(std::size_t peer, Message message, bool honest = true) {
        const Channel channel = k_message_table[message.index()].channel;
        hear_below(peer, channel, encode(std::move(message)), honest);
    }

    // ---- Steps of time and of the network.

    void wait() { now_ += k_pauses[in_.below(k_pauses.size())]; }
    void network() {
        above_hears_ = in_.flag();
        below_hears_ = in_.flag();
    }
    void line_below() {
        if (in_.flag())
            relay_.on_connection_lost(now_);
        else
            relay_.on_revoked(instance_of(in_.below(k_peers)), "Its key was taken off the list.", now_);
    }
    void pause() {
        const TimeNs pause = k_pauses[in_.below(k_pauses.size())];
        now_ += pause;
        relay_.on_own_pause(pause);
    }
    void drain() {
        if (in_.below(4) == 0) relay_.drain(now_);
    }

    // ---- Steps of the client above.

    void welcome() {
        message::Welcome welcome;
        state_ = in_.below(k_small_states);
        welcome.session = k_session_above;
        welcome.server = ServerId{1};
        welcome.credits = 1 + std::uint32_t(in_.below(4));
        welcome.epoch.value = epoch_ = std::uint32_t(in_.below(4));
        welcome.sequence = sequence_ = in_.number();
        welcome.state = pack(PackValue(encode_state(small_state(state_))));
        welcome.state_hash = hash_text(welcome.state);
        say_above(std::move(welcome));
    }
    void manifest() {
        const std::string files = pack_manifest(small_manifest(state_ % k_small_manifests));
        say_above(message::Manifest{hash_text(files), in_.below(8) == 7 ? std::string(in_.text()) : files});
    }
    void piece() { send_piece(in_.below(k_small_files.size()), in_.below(8) == 7); }
    void send_piece(std::size_t file, bool cut) {
        message::Piece piece;
        piece.hash = hash_text(k_small_files[file]);
        piece.bytes = k_small_files[file];
        piece.total = piece.bytes.size();
        if (cut) piece.bytes.resize(piece.bytes.size() / 2);
        say_above(std::move(piece));
    }
    void input() {
        const std::size_t next = in_.below(k_small_states);
        message::Input input;
        input.session = k_session_above;
        input.epoch.value = ++epoch_;
        input.sequence = std::max<std::uint64_t>(1, ++sequence_);
        input.state_hash = state_hash(small_state(next));
        input.changes = pack(PackValue(state_changes(small_state(state_), small_state(next))));
        state_ = next;
        say_above(std::move(input));
    }
    void snapshot() {
        message::Snapshot snapshot;
        state_ = in_.below(k_small_states);
        snapshot.session = k_session_above;
        snapshot.epoch.value = epoch_ = std::uint32_t(in_.number());
        snapshot.sequence = sequence_ = in_.number();
        snapshot.state = pack(PackValue(encode_state(small_state(state_))));
        snapshot.state_hash = hash_text(snapshot.state);
        say_above(std::move(snapshot));
    }
    void checked() { finish_check(in_.below(4) > 0); }
    void finish_check(bool well) {
        if (!checking_) return;
        const auto [state, manifest] = *std::exchange(checking_, std::nullopt);
        CheckedScene checked{state, failed("a.obj: it is not what its hash says.")};
        if (well) checked.depot = SceneDepot(manifest, scene_cache());
        relay_.on_checked(checked, now_);
    }
    void lease() {
        message::Lease lease;
        lease.session = k_session_above;
        lease.lease.value =
            std::max<std::uint64_t>(1, ++last_lease_ - (in_.below(8) == 7));  // At times again.
        lease.epoch.value = in_.below(8) == 7 ? std::uint32_t(in_.number()) : epoch_;
        lease.strategy = k_blocks_strategy;
        lease.unit = in_.byte();
        lease.rect = {int(in_.below(9)), int(in_.below(5)), 4, 4};
        lease.first = std::uint32_t(in_.below(4));
        lease.count = 1 + std::uint32_t(in_.below(24));
        lease.lease_ms = 1000;
        const std::optional<std::size_t> state = state_held();
        const GivenLease wanted{lease, state.value_or(0), 0};
        const auto [given, is_new] = given_.try_emplace(lease.lease.value, wanted);
        if (!is_new && (given->second.state != wanted.state || given->second.answers_left == 0)) return;
        lease = given->second.lease;
        ++given->second.answers_left;
        say_above(std::move(lease));
    }
    /// By the relay, which may have missed the last.
    [[nodiscard]] std::optional<std::size_t> state_held() const {
        for (std::size_t number = 0; number < k_small_states; ++number)
            if (relay_.above().working_on() == state_hash(small_state(number))) return number;
        return std::nullopt;
    }
    void cancel() {
        message::Cancel cancel{k_session_above, Epoch{epoch_}, {}};
        for (std::size_t n = in_.below(4); n > 0; --n) cancel.leases.push_back(last_lease_ - in_.below(4));
        say_above(std::move(cancel));
    }
    void goodbye_above() {
        if (in_.below(4) == 0) say_above(message::Bye{ByeReason::leaving, "The frame is finished."});
    }
    void forged_above() {
        const Frames frames = forged_message(in_, k_session_above);
        const MessageInfo* info = find_message(std::uint8_t(frames[0][3]));
        if (info->type == MessageType::lease) return;  // lease() keeps account of what it gives.
        hear_above(info->channel, frames);
    }
    void garbage_above() {
        const Channel channel = k_channel_names[in_.below(k_channel_names.size())].value;
        hear_above(channel, raw_frames(in_));
    }

    // ---- Steps of the servers below.

    void join_below() {
        const std::size_t peer = in_.below(k_peers);
        say_below(peer,
                  message::Hello{instance_of(peer), "peer", "0", own_bits().build, 1, 1, own_bits().golden});
        ready(peer);
    }
    /// It holds the state and asks for work.
    void ready(std::size_t peer) {
        if (!relay_.below()) return;
        const RenderState& state = relay_.below()->state();
        say_below(peer, message::Ready{k_session_below, relay_.below()->epoch(), 0, state_hash(state)});
        say_below(peer, message::Credit{k_session_below, 2, received_[peer]});
    }
    void hello() {
        const std::size_t peer = in_.below(k_peers);
        say_below(peer, message::Hello{instance_of(peer), "peer", "0", own_bits().build, 1, in_.byte(),
                                       own_bits().golden});
    }
    void ready_below() { ready(in_.below(k_peers)); }
    void tile() {
        if (leases_.empty()) return;
        const std::size_t pick = in_.below(leases_.size());
        const SentLease sent = leases_[pick];
        if (in_.flag()) leases_.erase(leases_.begin() + std::ptrdiff_t(pick));  // Else it may come twice.
        say_below(sent.peer, honest_tile(sent.lease, sent.seed, WireFormat::exact));
    }
    /// Somebody else's, of another range, of another light.
    void wrong_tile() {
        if (leases_.empty()) return;
        const SentLease sent = leases_[in_.below(leases_.size())];
        message::Tile tile = honest_tile(sent.lease, sent.seed, WireFormat::exact);
        std::size_t peer = sent.peer;
        switch (in_.below(7)) {
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
                tile.first = std::uint32_t(std::min<std::uint64_t>(in_.number(), k_max_samples_per_pixel));
                break;
            case 4:
                tile.count =
                    std::uint32_t(std::clamp<std::uint64_t>(in_.number(), 1, k_max_samples_per_pixel));
                break;
            case 5: {
                const auto quanta = std::int64_t(in_.number());
                put_block_result(tile,
                                 std::vector<PixelSum>(std::size_t(sent.lease.rect.area()), {quanta, 0, 1}),
                                 WireFormat::exact);
                break;
            }
            default:
                tile.rays = in_.number();
                tile.samples = in_.number();
                tile.render_ns = TimeNs(in_.number() >> 1);
                tile.dropped_count = tile.saturated_count = std::uint32_t(in_.number());
        }
        say_below(peer, std::move(tile), false);
    }
    void nack() {
        if (leases_.empty()) return;
        const SentLease& sent = leases_[in_.below(leases_.size())];
        say_below(sent.peer,
                  message::Nack{k_session_below, sent.lease.lease, sent.lease.epoch,
                                k_nack_code_names[in_.below(k_nack_code_names.size())].value, "no"});
    }
    void pong() {
        const auto at_once = 1 + std::uint32_t(in_.below(200));
        say_below(in_.below(k_peers), message::Pong{std::uint64_t(now_) - in_.number(), now_, now_,
                                                    in_.number(), in_.byte(), at_once});
    }
    void forged_below() {
        const std::size_t peer = in_.below(k_peers);
        const Frames frames = forged_message(in_, k_session_below);
        const MessageInfo* info = find_message(std::uint8_t(frames[0][3]));
        hear_below(peer, info->channel == Channel::input ? Channel::monitor : info->channel, frames, false);
    }
    void garbage_below() {
        hear_below(in_.below(k_peers), in_.flag() ? Channel::monitor : Channel::frames, raw_frames(in_),
                   false);
    }

    /// A client and a server, both honest, as far as they need each other.
    void join() {
        join_below();
        if (!relay_.above().linked()) link();
        welcome();
        say_above(message::Manifest{hash_text(pack_manifest(small_manifest(state_ % k_small_manifests))),
                                    pack_manifest(small_manifest(state_ % k_small_manifests))});
        for (std::size_t file = 1; file < k_small_files.size(); ++file) send_piece(file, false);
        finish_check(true);
        for (std::size_t peer = 0; peer < k_peers; ++peer) ready(peer);
        now_ += 60 * k_millisecond_ns;
    }

    static constexpr std::array k_steps{
        &RelayScript::wait,          &RelayScript::join,          &RelayScript::lease,
        &RelayScript::tile,          &RelayScript::join_below,    &RelayScript::ready_below,
        &RelayScript::welcome,       &RelayScript::manifest,      &RelayScript::piece,
        &RelayScript::checked,       &RelayScript::input,         &RelayScript::snapshot,
        &RelayScript::cancel,        &RelayScript::hello,         &RelayScript::wrong_tile,
        &RelayScript::nack,          &RelayScript::pong,          &RelayScript::forged_above,
        &RelayScript::forged_below,  &RelayScript::garbage_above, &RelayScript::garbage_below,
        &RelayScript::network,       &RelayScript::line_below,    &RelayScript::pause,
        &RelayScript::goodbye_above, &RelayScript::drain,
    };

    FuzzInput in_;
    TimeNs now_ = k_second_ns;
    bool above_hears_ = true, below_hears_ = true;
    bool lied_ = false;
    int links_ = 0;
    std::size_t state_ = 0, most_credits_ = 0;
    std::uint32_t epoch_ = 0;
    std::uint64_t sequence_ = 0, last_lease_ = 0;
    std::vector<SentLease> leases_;              ///< To servers.
    std::array<LeaseId, k_peers> received_{};    ///< By servers, the last.
    std::map<std::uint64_t, GivenLease> given_;  ///< By the client, by number.
    std::optional<std::pair<RenderState, Manifest>> checking_;
    EventStore store_;
    RelayMachine relay_;
};

void play(std::string_view bytes) { RelayScript(bytes).run(); }

std::vector<std::string> seeds() {
    using namespace std::string_literals;
    std::vector<std::string> seeds;
    for (int state = 0; state < int(k_small_states); ++state) {
        std::string honest = "\1\1\1\0"s + std::string{char(state), 3, 1, 1};
        for (const char first : {0, 1, 0, 3, 0, 0}) honest += "\2\0\0\0\4\2"s + first + '\13';
        for (int i = 0; i < 40; ++i) honest += "\3\0\1\5\1\0\3"s;
        seeds.push_back(honest);
        seeds.push_back(honest + "\12\1\5\1\0\5\2\0\0\0\4\2\0\5\3\0\1\3\0\1\13\2\0\1\5\1"s);
        seeds.push_back(honest.substr(0, 30) + "\25\0\1\3\0\1\25\1\1\14\2\1\2\26\0\27\4\30\0\31\0\3\0\1"s);
    }
    const std::string joined = "\0\1\1\1\1\3\1\1\2\0\0\0\4\2\0\13"s;
    for (int kind = 0; kind < 7; ++kind)
        seeds.push_back(joined + "\16"s + std::string{0, char(kind), '\xcc', '\xcf'} + "\3\0\1\0\3"s);
    for (int type = 0; type < 20; ++type)
        for (const char* const side : {"\21", "\22\1"})
            seeds.push_back(joined + side + std::string(1, char(type)) + std::string(40, '\5') +
                            "\0\5\3\0\1"s);
    return seeds;
}

const FuzzTarget k_target{"relay", play, seeds};

}  // namespace
}  // namespace pathscope::fuzz
