#include "pathscope/session/work_identity.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

RenderState some_state() {
    RenderState state;
    state.scene.name = "a room";
    return state;
}

std::string difference_between(const RenderState& theirs, const RenderState& ours) {
    return difference(identity_of(theirs, {}), identity_of(ours, {})).value_or("");
}

}  // namespace

TEST_CASE("each entry of the render state counts, but for the numbers of samples") {
    const WorkIdentity ours = identity_of(some_state(), {});
    CHECK(!difference(ours, ours));
    for (const auto& [key, value] : ours.state.entries()) {
        CAPTURE(key);
        WorkIdentity theirs = ours;
        theirs.state.set(key, PackArray{1, 2, 3});
        CHECK(difference(theirs, ours).has_value() == (key != "spp" && key != "direct_spp"));
    }
    WorkIdentity newer = ours;
    newer.state.set("fog", true);
    CHECK(difference(newer, ours) == "its fog is another");
}

TEST_CASE("what differs is named as people know it, with both values where they are short") {
    const RenderState ours = some_state();
    RenderState theirs = ours;
    theirs.settings.seed = 7;
    theirs.settings.width = 100;
    theirs.settings.height = 50;
    theirs.settings.transport.mis = MisHeuristic::balance;
    theirs.options.smoothing = false;
    CHECK(difference_between(theirs, ours) ==
          "its --smoothing is off, not on; its --size is 100x50, not 640x360; its --seed is 7, not 1; its "
          "--mis is "
          "balance, not power");
    theirs = ours;
    theirs.scene.name = "another room";
    CHECK(difference_between(theirs, ours) == "its scene is another");
    theirs = ours;
    theirs.files[0] = 1;
    CHECK(difference_between(theirs, ours) == "its content of OBJ, MTL or texture files is another");
    theirs = ours;
    theirs.camera.vfov_deg = 12;
    CHECK(difference_between(theirs, ours) == "its camera is another");
}

TEST_CASE("build, blocks, rounds and the sampling rule count; how rounds are handed out does not") {
    const WorkIdentity ours = identity_of(some_state(), {});
    WorkPlan plan;
    plan.schedule = ScheduleKind::static_shares;
    plan.order = UnitOrder::scanline;
    CHECK(!difference(identity_of(some_state(), plan), ours));
    plan.block_size = 16;
    plan.round_samples = 2;
    plan.sampling = {true, 0.5};
    CHECK(difference(identity_of(some_state(), plan), ours) ==
          "its --block is 16, not 32; its --round is 2, not 4; its --adaptive is on, not off; its "
          "--target-error is "
          "0.5, not 0");
    WorkIdentity theirs = ours;
    theirs.build = "another\n";
    CHECK(difference(theirs, ours)->starts_with("its build is another?, not "));
}
