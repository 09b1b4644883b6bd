#include "pathscope/session/round_runner.hpp"

#include "integrator/estimator_scenes.hpp"
#include "pathscope/net/poller.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr TimeNs k_patience = 120 * k_second_ns;  ///< A test that waits longer has failed.

/// Rounds in the middle of a furnace: whose runner, and what it has finished.
struct SmallRun {
    WakePair wake = *WakePair::create();
    std::shared_ptr<const Scene> scene = std::make_shared<const Scene>(furnace(0.5f, 0.5f));
    RenderSettings settings;
    RoundRunner runner;

    explicit SmallRun(double samples_per_second = 0) : runner(wake, 1, samples_per_second) {
        settings.width = 24;
        settings.height = 16;
        settings.quantum = quantum_for(1, 1);
    }
    [[nodiscard]] RoundJob job(std::uint64_t ticket, LightPart part = LightPart::indirect) const {
        const Round round = BlockGrid(24, 16, 8).round(std::uint32_t(ticket % 6), 4, 4);
        return {ticket, part, round, scene, Camera{}, settings};
    }
    /// The next outcomes, in order.
    std::vector<RoundOutcome> take(std::size_t count) {
        std::vector<RoundOutcome> outcomes;
        while (outcomes.size() < count) {
            REQUIRE(wait_readable({wake.pollable()}, k_patience)[0]);
            wake.clear();
            for (RoundOutcome& outcome : runner.take_finished()) outcomes.push_back(std::move(outcome));
        }
        REQUIRE(outcomes.size() == count);
        return outcomes;
    }
};

}  // namespace

TEST_CASE("every round that was begun has one outcome, in order, with the bits of render_round") {
    SmallRun run;
    std::vector<RoundJob> jobs;
    for (const std::uint64_t ticket : {7, 3, 5, 4}) {
        jobs.push_back(run.job(ticket, ticket == 3 ? LightPart::direct : LightPart::indirect));
        run.runner.begin(jobs.back());
    }
    CHECK(run.runner.pending() == 4);
    const std::vector<RoundOutcome> outcomes = run.take(4);
    CHECK(run.runner.pending() == 0);
    for (std::size_t i = 0; i < 4; ++i) {
        const RoundJob& job = jobs[i];
        const auto expected =
            render_round(*run.scene, job.camera, job.settings, job.part, job.round, 1, nullptr);
        CHECK(outcomes[i].ticket == job.ticket);
        CHECK(outcomes[i].part == job.part);
        CHECK(outcomes[i].round == job.round);
        CHECK(outcomes[i].failure.empty());
        REQUIRE(bool(outcomes[i].result));
        CHECK(outcomes[i].result->sums == expected->sums);
        CHECK(outcomes[i].result->samples == job.round.samples());
        CHECK(outcomes[i].result->rays == expected->rays);
    }
    CHECK(outcomes[0].result->sums != outcomes[2].result->sums);  // Or equal bits would say nothing.
}

TEST_CASE("the direct part of the same round comes beside the indirect one, if asked for") {
    SmallRun run;
    RoundJob job = run.job(2);
    job.direct_too = true;
    run.runner.begin(job);
    const std::vector<RoundOutcome> outcomes = run.take(1);
    REQUIRE((outcomes[0].result && outcomes[0].direct));
    for (const LightPart part : {LightPart::direct, LightPart::indirect}) {
        const auto alone = render_round(*run.scene, job.camera, job.settings, part, job.round, 1);
        const auto& beside = part == LightPart::direct ? outcomes[0].direct : outcomes[0].result;
        CHECK(beside->sums == alone->sums);
    }
}

TEST_CASE("a speed cap stretches a round to the time that its samples take") {
    SmallRun run(2560);  // 256 samples: a tenth of a second.
    run.runner.begin(run.job(1));
    const std::vector<RoundOutcome> outcomes = run.take(1);
    REQUIRE(bool(outcomes[0].result));
    CHECK(outcomes[0].result->samples == 256);
    CHECK(outcomes[0].duration >= 100 * k_millisecond_ns);
}

TEST_CASE("a cancelled round that waits has an empty outcome, and cancelling ends a stretched one") {
    SmallRun run(0.01);  // Seven hours for a round: all others wait for the first.
    for (const std::uint64_t ticket : {9, 1, 2, 8, 3, 4}) run.runner.begin(run.job(ticket));
    run.runner.cancel(2);
    run.runner.cancel(77);  // Nobody's.
    CHECK(run.runner.pending() == 6);

    SUBCASE("one by one") {
        run.runner.cancel(1);
        run.runner.cancel(9);
        const std::vector<RoundOutcome> outcomes = run.take(3);  // Then 8 holds up the rest.
        CHECK(outcomes[0].ticket == 9);
        CHECK_FALSE(outcomes[0].result.has_value());
        CHECK(outcomes[1].ticket == 1);
        CHECK(!outcomes[1].result);
        CHECK(outcomes[1].failure.empty());
        CHECK(outcomes[2].ticket == 2);
        CHECK(!outcomes[2].result);
        CHECK(run.runner.pending() == 3);
        run.runner.begin(run.job(9));  // The name is free again.
        CHECK(run.runner.pending() == 4);
    }
    SUBCASE("all") {
        run.runner.cancel_all();
        const std::vector<RoundOutcome> outcomes = run.take(6);
        for (std::size_t i = 1; i < 3; ++i) CHECK(!outcomes[i].result);
        CHECK(run.runner.pending() == 0);
    }
    // The runner's end does not wait for seven hours either.
}

TEST_CASE("the counter of work rises by every sample, and goes on while a slow machine is modelled") {
    SmallRun fast;
    fast.runner.begin(fast.job(1));
    const std::uint64_t samples = fast.take(1)[0].result->samples;
    CHECK(fast.runner.work_done() == samples);

    SmallRun slow(double(samples) / 1.5);  // A round takes a second and a half.
    slow.runner.begin(slow.job(1));
    // Until it has risen, or the round has ended.
    while (slow.runner.work_done() < samples + 2 &&
           !wait_readable({slow.wake.pollable()}, 10 * k_millisecond_ns)[0]) {
    }
    CHECK(slow.runner.take_finished().empty());  // It rose within the round.
    CHECK(slow.take(1)[0].result->samples == samples);
    CHECK(slow.runner.work_done() > samples + 2);
}
