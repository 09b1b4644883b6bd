#include "pathscope/session/relay_machine.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr std::uint64_t k_session_above = 77;

/// Scenes of no files but one each that is missing, so that there is nothing to fetch but the list.
Manifest files_of(const std::string& scene) {
    Manifest manifest;
    manifest.missing = {scene + ".png"};
    return manifest;
}

RenderState state_of(const std::string& scene) {
    RenderState state;
    state.scene = *parse_scene_file(
        R"({"obj": "a.obj", "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0]}})", "a.json");
    state.files = hash_text(pack_manifest(files_of(scene)));
    state.camera = state.scene.cameras.front().view;
    state.settings.width = state.settings.height = 8;
    return state;
}

/// A relay that hears what the client of the test says. No server is there, which it would find out by its timers.
class StagedRelay : private RelayWorld {
  public:
    void link() { relay_.above().on_linked("above", now_); }
    void leave() { relay_.above().leave("No server is left.", now_); }

    /// The client asks for this scene, and sends the list of its files.
    void ask_for(const std::string& scene) {
        const std::string bytes = pack(PackValue(encode_state(state_of(scene))));
        ++sequence_;
        if (relay_.above().welcomed()) {
            message::Snapshot snapshot;
            snapshot.session = k_session_above;
            snapshot.epoch.value = std::uint32_t(sequence_);
            snapshot.sequence = sequence_;
            snapshot.state_hash = hash_text(bytes);
            snapshot.state = bytes;
            say(snapshot);
        } else {
            message::Welcome welcome;
            welcome.session = k_session_above;
            welcome.server = ServerId{1};
            welcome.epoch.value = std::uint32_t(sequence_);
            welcome.sequence = sequence_;
            welcome.state_hash = hash_text(bytes);
            welcome.state = bytes;
            say(welcome);
        }
        const std::string files = pack_manifest(files_of(scene));
        say(message::Manifest{hash_text(files), files});
    }
    /// The files that were last to be checked are what they should be.
    void finish_check() {
        REQUIRE(checking_.has_value());
        auto [state, manifest] = *std::exchange(checking_, std::nullopt);
        CheckedScene checked{std::move(state), SceneDepot(manifest, SceneCache(folder_.path()))};
        relay_.on_checked(checked, now_);
    }
    [[nodiscard]] bool works_on(const std::string& scene) const {
        return relay_.above().working_on() == state_hash(state_of(scene));
    }

  private:
    void say(Message message) {
        const Channel channel = k_message_table[message.index()].channel;
        relay_.above().on_message(encode(std::move(message)), channel, now_);
    }
    bool send_up(Channel, Frames&&) override { return true; }
    bool send_down(Channel, const std::string&, Frames) override { return true; }
    void publish_down(Frames) override {}
    void check_scene(RenderState state, Manifest manifest) override {
        checking_.emplace(std::move(state), std::move(manifest));
    }

    TemporaryFolder folder_{};
    TimeNs now_ = k_second_ns;
    EventStore store_{};
    RelayMachine relay_{{"relay", "0", {"build", {}}, 1, 7, "client"},
                        SceneCache(folder_.path()),
                        ClientConfig{},
                        5,
                        store_,
                        *this};
    std::optional<std::pair<RenderState, Manifest>> checking_{};
    std::uint64_t sequence_ = 0;
};

}  // namespace

TEST_CASE("a client may go back to the scene that a relay has, however many it asked for in between") {
    StagedRelay relay;
    relay.link();
    relay.ask_for("a");
    relay.leave();
    relay.finish_check();  // While no client is there, nobody has to be ready for it.
    relay.link();
    relay.ask_for("a");
    CHECK(relay.works_on("a"));

    relay.ask_for("b");
    CHECK_FALSE(relay.works_on("b"));
    relay.ask_for("a");
    CHECK(relay.works_on("a"));
    relay.finish_check();  // Of b, which nobody wants any more.
    relay.ask_for("c");
    relay.finish_check();
    CHECK_FALSE(relay.works_on("c"));  // No server is there to load it.
    relay.ask_for("a");
    CHECK(relay.works_on("a"));
}
