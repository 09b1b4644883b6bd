#pragma once
/// A client and servers on a stage: the real state machines, in virtual time, and a network in the hands of the test.
///
///     StagedCluster stage;
///     StagedCluster::Server& a = stage.add_server();
///     CHECK(stage.pass_until([&] { return stage.committed() > 0; }));
///     a.cut = true;                                  // the cable
///
/// Where the simulated cluster (simulated_cluster.hpp) throws every fault at once and believes nobody, here one fault happens
/// at its moment, and the test says what must follow. Nothing is random: a message takes one millisecond, a round of a
/// server too, and light is that of simulated_renderer.hpp, so that a picture can be told right or wrong.

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pathscope/session/admission.hpp"
#include "pathscope/session/client_machine.hpp"
#include "pathscope/session/server_machine.hpp"

#include "simulated_renderer.hpp"

namespace pathscope::testing {

class StagedCluster : private ClientWorld {
  public:
    class Server : private ServerWorld {
      public:
        bool cut = false;                          ///< Nothing gets through, either way; nobody is told.
        bool killed = false;                       ///< As by kill -9.
        bool renders = true;                       ///< Else rounds stay in work.
        bool hears_cancel = true;                  ///< Else what was cancelled is on its way already.
        std::function<bool(const Round&)> lies{};  ///< Of which rounds it gives another light than theirs.
        std::optional<Channel> flipped{};          ///< There a bit flips in the routing id of its next link.
        std::vector<MessageType> heard;
        std::vector<message::Lease> leases;  ///< That reached it.
        int links = 0;                       ///< How often it dialled.

        /// Says goodbye and hangs up.
        void leave() {
            machine_.say_goodbye(stage_.now_);
            killed = true;
        }

        [[nodiscard]] const ServerMachine& machine() const { return machine_; }
        [[nodiscard]] const std::string& instance() const { return instance_; }

      private:
        friend StagedCluster;
        Server(StagedCluster& stage, int number, std::string name, BitsIdentity bits)
            : stage_(stage),
              number_(number),
              machine_({std::move(name), "0", std::move(bits), 1, std::uint32_t(number), "client"},
                       SceneCache({}), *this) {}

        /// By which routing id the client knows it there.
        [[nodiscard]] std::string seen_as(Channel channel) const {
            std::string id = instance_;
            if (flipped_here_ == channel) id[1] = char(id[1] ^ 1);
            return id;
        }

        void receive(Frames frames, Channel channel) {
            if (cut || killed || !machine_.linked()) return;
            const Frames copy = frames;
            if (Decoded message = decode(Frames(copy), Role::server, channel)) {
                heard.push_back(type_of(*message));
                if (heard.back() == MessageType::cancel && !hears_cancel) return;
                if (auto* lease = std::get_if<message::Lease>(&*message)) leases.push_back(*lease);
            }
            machine_.on_message(std::move(frames), channel, stage_.now_);
        }
        void step() {
            if (killed) return;
            if (!machine_.linked()) {
                instance_ = fmt::format("{:>07}.link{:>4}", number_, ++links);
                flipped_here_ = std::exchange(flipped, std::nullopt);
                machine_.on_linked(instance_, stage_.now_);
            }
            if (wanted_) {
                LoadedScene loaded{*std::exchange(wanted_, std::nullopt), std::make_shared<const Scene>()};
                machine_.on_loaded(loaded, stage_.now_);
            }
            if (!jobs_.empty() && (renders || cancelled_.contains(jobs_.front().ticket))) {
                RoundOutcome outcome = finish(jobs_.front(), cancelled_.contains(jobs_.front().ticket));
                jobs_.pop_front();
                ++done_;
                if (outcome.result && lies && lies(outcome.round))
                    outcome.result->sums[0] += PixelSum{1 << 20, 0, 0};
                machine_.on_outcome(outcome, stage_.now_);
            }
            machine_.on_timers(stage_.now_);
        }

        bool send(Channel channel, Frames&& frames) override {
            if (!cut) stage_.to_client(seen_as(channel), channel, std::move(frames));
            return true;
        }
        void begin(RoundJob job) override { jobs_.push_back(std::move(job)); }
        [[nodiscard]] std::uint64_t work_done() const override { return done_; }
        void cancel(std::uint64_t ticket) override { cancelled_.insert(ticket); }
        void cancel_all() override {
            for (const RoundJob& job : jobs_) cancel(job.ticket);
        }
        void load(RenderState state, Manifest) override { wanted_ = std::move(state); }

        StagedCluster& stage_;
        int number_;
        std::string instance_;
        std::optional<Channel> flipped_here_;
        std::deque<RoundJob> jobs_;
        std::set<std::uint64_t> cancelled_;
        std::uint64_t done_ = 0;
        std::optional<RenderState> wanted_;
        ServerMachine machine_;
    };

    bool lose_inputs = false;  ///< PUB is lossy: here it loses all.
    std::vector<MessageType>
        to_strangers;  ///< What the client said to peers that are no server of the stage.

    /// adjust: what is to be other than usual.
    using Adjust = std::function<void(ClientConfig&, RenderSettings&)>;
    explicit StagedCluster(std::uint32_t spp = 64, const Adjust& adjust = {}) {
        config_.listens = true;
        config_.min_servers = 1;
        config_.block_size = 8;
        config_.round_samples = 2;
        config_.lease_time = 0;  // One round each: tests count leases.
        RenderState state;
        state.scene = *parse_scene_file(
            R"({"obj": "a.obj", "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0]}})", "a.json");
        state.camera = state.scene.cameras.front().view;
        state.settings.width = state.settings.height = 16;
        state.settings.spp = spp;
        state.settings.direct_spp = 1;
        if (adjust) adjust(config_, state.settings);
        start_client(std::move(state));
    }

    /// The client that was there dies without a word; another takes its place and begins the frame anew.
    void restart_client() { start_client(client_->state()); }

    /// Several may have one name: to the client they are one and the same, or one that came back.
    Server& add_server(std::string name = {}, BitsIdentity bits = own_bits()) {
        const int number = int(servers_.size()) + 1;
        if (name.empty()) name = fmt::format("server-{}", number);
        servers_.push_back(
            std::unique_ptr<Server>(new Server(*this, number, std::move(name), std::move(bits))));
        return *servers_.back();
    }

    [[nodiscard]] ClientMachine& client() { return *client_; }
    [[nodiscard]] const EventStore& store() const { return *store_; }
    [[nodiscard]] TimeNs now() const { return now_; }
    [[nodiscard]] std::uint64_t committed() const {
        return client_->work().indirect_ledger().rounds_committed();
    }

    /// One millisecond at a time.
    bool pass_until(const std::function<bool()>& done, TimeNs limit = 20 * k_second_ns) {
        for (const TimeNs end = now_ + limit; now_ < end; step())
            if (done()) return true;
        return done();
    }
    void pass(TimeNs time) {
        (void)pass_until([] { return false; }, time);
    }

    /// Whether both parts are what the samples of the client's state give, each once.
    [[nodiscard]] bool picture_is_right() const {
        const RenderSettings& settings = client_->state().settings;
        const auto is_right = [&](LightPart part, const FrameSums& sums, std::uint32_t spp) {
            for (int y = 0; y < settings.height; ++y)
                for (int x = 0; x < settings.width; ++x) {
                    const std::uint32_t samples = sums.samples_of_block(sums.grid().block_at(x, y));
                    // With passes, the rule says how many there are.
                    if (samples != spp && !config_.sampling.staged()) return false;
                    PixelSum expected;
                    for (std::uint32_t s = 0; s < samples; ++s)
                        expected += light_of(settings.seed, part, x, y, s);
                    if (sums.sum_at(x, y) != expected) return false;
                }
            return true;
        };
        return is_right(LightPart::indirect, client_->work().indirect(), settings.spp) &&
               is_right(LightPart::direct, client_->work().direct(), settings.direct_spp);
    }

  private:
    [[nodiscard]] static RoundOutcome finish(const RoundJob& job, bool cancelled) {
        RoundOutcome outcome;
        outcome.ticket = job.ticket;
        outcome.part = job.part;
        outcome.round = job.round;
        outcome.duration = k_millisecond_ns;
        if (cancelled) return outcome;
        outcome.result = render_by_hash(job, job.part);
        if (job.direct_too) outcome.direct = render_by_hash(job, LightPart::direct);
        return outcome;
    }

    void start_client(RenderState state) {
        jobs_.clear();
        cancelled_.clear();
        client_.reset();
        store_ = std::make_unique<EventStore>();
        client_ =
            std::make_unique<ClientMachine>(config_, ClientJob{std::move(state), nullptr, SceneDepot()},
                                            ++sessions_, *store_, static_cast<ClientWorld&>(*this), now_);
    }

    void step() {
        now_ += k_millisecond_ns;
        for (const auto& arrive : std::exchange(on_their_way_, {})) arrive();
        for (const auto& server : servers_) server->step();
        if (!jobs_.empty()) {
            RoundOutcome outcome = finish(jobs_.front(), cancelled_.contains(jobs_.front().ticket));
            jobs_.pop_front();
            client_->on_outcome(outcome, now_);
        }
        client_->on_timers(now_);
    }

    void to_client(const std::string& instance, Channel channel, Frames frames) {
        on_their_way_.push_back(
            [=, this, frames = std::move(frames)] { client_->on_message(instance, frames, channel, now_); });
    }
    [[nodiscard]] Server* find(const std::string& instance, Channel channel) {
        for (const auto& server : servers_)
            if (server->seen_as(channel) == instance) return server.get();
        return nullptr;
    }

    bool send(Channel channel, const std::string& instance, Frames frames) override {
        Server* const server = find(instance, channel);
        if (!server) {
            to_strangers.push_back(MessageType(std::uint8_t(frames[0][3])));
            return channel == Channel::monitor;
        }
        if (server->killed) return false;
        if (!server->cut)
            on_their_way_.push_back([=, frames = std::move(frames)] { server->receive(frames, channel); });
        return true;
    }
    void publish(Frames frames) override {
        if (lose_inputs) return;
        for (const auto& server : servers_)
            (void)send(Channel::input, server->seen_as(Channel::input), frames);
    }
    void begin(RoundJob job) override { jobs_.push_back(std::move(job)); }
    void cancel_all() override {
        for (const RoundJob& job : jobs_) cancelled_.insert(job.ticket);
    }

    TimeNs now_ = k_second_ns;
    std::uint64_t sessions_ = 0;
    std::vector<std::function<void()>> on_their_way_;
    std::vector<std::unique_ptr<Server>> servers_;
    std::deque<RoundJob> jobs_;  ///< Of the client.
    ClientConfig config_;
    std::set<std::uint64_t> cancelled_;
    std::unique_ptr<EventStore> store_;
    std::unique_ptr<ClientMachine> client_;
};

}  // namespace pathscope::testing
