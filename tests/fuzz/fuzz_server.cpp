/// A render server whose client says anything at any time: it never begins a round that could not be rendered, holds no
/// more than its credits, and what it sends is a message that a client decodes.
///
///     bytes = *step                   ; a step is one of k_steps and what that step reads

#include "../temporary_folder.hpp"
#include "forged_message.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/session/server_machine.hpp"
#include "small_states.hpp"

namespace pathscope::fuzz {
namespace {

constexpr std::uint64_t k_session = 77;
constexpr int k_most_steps = 200;
constexpr std::int64_t k_most_pixels =
    4096;  ///< A larger round is cancelled: its sums would take long to write down.

/// Empty at the beginning of each script: the files of the small manifests are taken away.
const SceneCache& scene_cache() {
    static const testing::TemporaryFolder folder;
    static const SceneCache cache(folder.path());
    for (const std::string_view file : k_small_files) cache.forget(hash_text(file));
    return cache;
}

class ServerScript : private ServerWorld {
  public:
    explicit ServerScript(std::string_view bytes)
        : in_(bytes), machine_({"server", "0", own_bits(), 1, 7, "client"}, scene_cache(), *this) {}

    void run() {
        machine_.on_linked(std::string(16, 'i'), now_);
        for (int step = 0; step < k_most_steps && !in_.empty() && !machine_.ended(); ++step) {
            (this->*k_steps[in_.below(k_steps.size())])();
            machine_.on_timers(now_);
            CHECK(machine_.next_timer(now_) >= now_, now_);
            CHECK(machine_.leases() <= rounds_.size(), machine_.leases(), rounds_.size());
            CHECK(machine_.leases() <= most_credits_, machine_.leases(), most_credits_);
            CHECK(machine_.unsent_answers() <= 2 * most_credits_ + 16, machine_.unsent_answers(),
                  most_credits_);
            if (!machine_.linked()) machine_.on_linked(std::string(16, char('a' + step % 26)), now_);
        }
        if (machine_.linked() && !machine_.ended()) machine_.say_goodbye(now_);
    }

  private:
    // ---- The world.

    bool send(Channel channel, Frames&& frames) override {
        const Decoded decoded = decode(frames, Role::client, channel);
        CHECK(bool(decoded), decoded.error().sentence);
        return reachable_;
    }
    void begin(RoundJob job) override {
        const RenderSettings& settings = job.settings;
        const PixelRect& rect = job.round.rect;
        CHECK(job.scene != nullptr);
        CHECK(!rect.empty() && (PixelRect{0, 0, settings.width, settings.height}.contains(rect)), rect);
        CHECK(job.round.count >= 1 && job.round.count <= k_max_samples_per_pixel, job.round.count);
        CHECK(job.round.first <= k_max_samples_per_pixel - job.round.count, job.round.first);
        rounds_.push_back(std::move(job));
    }
    void cancel(std::uint64_t ticket) override {
        CHECK(std::any_of(rounds_.begin(), rounds_.end(),
                          [&](const RoundJob& job) { return job.ticket == ticket; }),
              ticket);
    }
    void cancel_all() override {}
    [[nodiscard]] std::uint64_t work_done() const override { return 0; }
    void load(RenderState state, Manifest) override {
        CHECK(!loading_.has_value());
        loading_ = std::move(state);
    }

    // ---- What the client says.

    void deliver(Channel channel, Frames frames) {
        if (Decoded decoded = decode(frames, Role::server, channel))
            if (const auto* welcome = std::get_if<message::Welcome>(&*decoded))
                most_credits_ = std::max<std::size_t>(most_credits_, welcome->credits);
        machine_.on_message(std::move(frames), channel, now_);
    }
    void say(Message message) {
        const Channel channel = k_message_table[message.index()].channel;
        deliver(channel, encode(std::move(message)));
    }
    [[nodiscard]] std::string packed(std::size_t number) const {
        return pack(PackValue(encode_state(small_state(number))));
    }

    // ---- Steps.

    void wait() {
        constexpr std::array<TimeNs, 6> k_pauses{0,           k_millisecond_ns, 250 * k_millisecond_ns,
                                                 k_second_ns, 3 * k_second_ns,  30 * k_second_ns};
        now_ += k_pauses[in_.below(k_pauses.size())];
    }
    void welcome() {
        message::Welcome welcome;
        state_ = in_.below(k_small_states);
        welcome.session = k_session;
        welcome.server = ServerId{1};
        welcome.credits = 1 + std::uint32_t(in_.below(4));
        welcome.epoch.value = epoch_ = std::uint32_t(in_.below(4));
        welcome.sequence = sequence_ = in_.number();
        welcome.state = packed(state_);
        welcome.state_hash = hash_text(welcome.state);
        say(std::move(welcome));
    }
    /// Welcomed, fetched, loaded.
    void join() {
        welcome();
        manifest();
        for (std::size_t file = 1; file < k_small_files.size(); ++file) send_piece(file, 0);
        if (loading_) finish_loading(true);
    }
    void snapshot() {
        message::Snapshot snapshot;
        state_ = in_.below(k_small_states);
        snapshot.session = k_session;
        snapshot.epoch.value = epoch_ = std::uint32_t(in_.number());
        snapshot.sequence = sequence_ = in_.number();
        snapshot.state = packed(state_);
        snapshot.state_hash = hash_text(snapshot.state);
        say(std::move(snapshot));
    }
    void input() {
        const std::size_t next = in_.below(k_small_states);
        message::Input input;
        input.session = k_session;
        input.epoch.value = ++epoch_;
        input.sequence = std::max<std::uint64_t>(1, ++sequence_);
        input.state_hash = state_hash(small_state(next));
        input.changes = pack(PackValue(state_changes(small_state(state_), small_state(next))));
        if (in_.below(8) == 0) input.changes = in_.text();
        state_ = next;
        say(std::move(input));
    }
    void manifest() {
        const std::string files = pack_manifest(small_manifest(state_ % k_small_manifests));
        say(message::Manifest{hash_text(files), files});
    }
    void lying_manifest() {
        const std::string files = pack_manifest(small_manifest(state_ % k_small_manifests));
        say(message::Manifest{hash_text(files), std::string(in_.text())});
    }
    void piece() { send_piece(in_.below(k_small_files.size()), in_.number()); }
    void send_piece(std::size_t file, std::uint64_t wrong) {
        message::Piece piece;
        piece.hash = hash_text(k_small_files[file]);
        piece.bytes = k_small_files[file];
        piece.total = piece.bytes.size();
        if (wrong == 1) piece.bytes.resize(piece.bytes.size() / 2);
        if (wrong == 2 && !piece.bytes.empty()) piece.bytes[0] ^= 1;
        if (wrong > 2)
            piece.total = std::clamp<std::uint64_t>(wrong, piece.bytes.size(), std::uint64_t{1} << 40);
        say(std::move(piece));
    }
    void lying_piece() {
        message::Piece piece;
        piece.hash = hash_text("none has these bytes");
        piece.offset = std::uint64_t(in_.below(3)) * k_max_piece_bytes;
        piece.total = 700'000;
        piece.bytes.assign(std::min<std::size_t>(k_max_piece_bytes, piece.total - piece.offset), 'x');
        say(std::move(piece));
    }
    void finish_loading(bool well) {
        RenderState state = std::move(*loading_);
        loading_.reset();
        LoadedScene loaded{std::move(state), failed("a.obj: line 1 is wrong.")};
        if (well) loaded.scene = std::make_shared<const Scene>();
        machine_.on_loaded(loaded, now_);
    }
    void loaded() {
        if (loading_) finish_loading(in_.below(4) > 0);
    }
    void lease() {
        message::Lease lease;
        lease.session = k_session;
        lease.lease.value = ++last_lease_ - in_.below(2);  // At times one that it holds.
        if (lease.lease.value == 0) lease.lease.value = 1;
        lease.epoch.value = in_.below(8) == 0 ? std::uint32_t(in_.number()) : epoch_;
        lease.strategy = k_blocks_strategy;
        lease.unit = in_.byte();
        lease.rect = {int(in_.below(8)), int(in_.below(5)), 4, 4};
        lease.count = 1;
        if (in_.below(8) == 0) {
            const auto side = [this] { return int(std::clamp<std::uint64_t>(in_.number(), 1, 32'768)); };
            lease.rect = {side(), side(), side(), side()};
            lease.first = std::uint32_t(std::min<std::uint64_t>(in_.number(), 0x7fff'ffff));
            lease.count = std::uint32_t(std::clamp<std::uint64_t>(in_.number(), 1, 0x7fff'ffff));
        }
        lease.lease_ms = 1000;
        say(std::move(lease));
    }
    void outcome() {
        if (rounds_.empty()) return;
        const auto pick =
            rounds_.begin() + std::ptrdiff_t(in_.below(std::min<std::size_t>(rounds_.size(), 256)));
        const RoundJob job = std::move(*pick);
        rounds_.erase(pick);
        RoundOutcome outcome;
        outcome.ticket = job.ticket;
        outcome.round = job.round;
        const std::size_t how = in_.below(8);
        if (how == 0) outcome.failure = "There is no memory for it.";
        if (how > 1 && job.round.rect.area() <= k_most_pixels) {
            outcome.result.emplace();
            outcome.result->sums.resize(std::size_t(job.round.rect.area()), {job.round.count, 2, 3});
            outcome.result->samples = job.round.samples();
        }
        machine_.on_outcome(outcome, now_);
    }
    void cancel_leases() {
        message::Cancel cancel{k_session, Epoch{epoch_}, {}};
        if (in_.flag()) cancel.epoch.value = std::uint32_t(in_.number());
        for (std::size_t n = in_.below(4); n > 0; --n) cancel.leases.push_back(last_lease_ - in_.below(4));
        say(std::move(cancel));
    }
    void forged() {
        const Frames frames = forged_message(in_, k_session);
        deliver(find_message(std::uint8_t(frames[0][3]))->channel, frames);
    }
    void garbage() {
        const Channel channel = k_channel_names[in_.below(k_channel_names.size())].value;
        deliver(channel, raw_frames(in_));
    }
    void network() { reachable_ = in_.flag(); }
    void drain() {
        if (in_.below(4) == 0) machine_.drain(now_);
    }

    static constexpr std::array k_steps{
        &ServerScript::wait,           &ServerScript::welcome,       &ServerScript::join,
        &ServerScript::snapshot,       &ServerScript::input,         &ServerScript::manifest,
        &ServerScript::piece,          &ServerScript::loaded,        &ServerScript::lease,
        &ServerScript::outcome,        &ServerScript::cancel_leases, &ServerScript::forged,
        &ServerScript::lying_manifest, &ServerScript::lying_piece,   &ServerScript::network,
        &ServerScript::drain,          &ServerScript::garbage,
    };

    FuzzInput in_;
    TimeNs now_ = k_second_ns;
    bool reachable_ = true;
    std::size_t state_ = 0, most_credits_ = 0;
    std::uint32_t epoch_ = 0;
    std::uint64_t sequence_ = 0, last_lease_ = 0;
    std::vector<RoundJob> rounds_;
    std::optional<RenderState> loading_;
    ServerMachine machine_;
};

void play(std::string_view bytes) { ServerScript(bytes).run(); }

std::vector<std::string> seeds() {
    using namespace std::string_literals;
    std::vector<std::string> seeds;
    for (int state = 0; state < int(k_small_states); ++state) {
        const std::string joined = "\2"s + std::string{char(state), 2, 1, 1};
        seeds.push_back(joined + "\10\0\1\0\0\0\1\10\0\1\1\4\0\1\11\0\5\11\0\5"s);
        seeds.push_back(joined + "\4\2\1\10\0\1\0\0\0\1\4\3\1\7\1\12\0\2\1\0\11\0\1\0\3"s);
        seeds.push_back(joined + "\3\1\5\6\5\6\1\0\6\2\0\7\1\10\0\1\1\0\0\1\0\3\0\3\0\5"s);
    }
    seeds.push_back("\1\3\1\1\1\5\15\0\15\1\15\2\0\5\5\15\2\15\1\15\0"s);
    seeds.push_back("\1\1\1\1\1\14\4abcd\14\2\x80\x80\5\6\1\1\6\1\2\6\2\0\7\1"s);
    seeds.push_back("\2\0\2\1\1\16\0\10\0\1\0\0\0\1\11\0\5\0\1\16\1\17\0\0\3"s);
    for (int type = 0; type < 20; ++type)
        seeds.push_back("\2\0\2\1\1\13"s + std::string(1, char(type)) + std::string(40, '\5') +
                        "\10\0\1\0\0\0\1\0\3"s);
    return seeds;
}

const FuzzTarget k_target{"server", play, seeds};

}  // namespace
}  // namespace pathscope::fuzz
