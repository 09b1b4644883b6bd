/// Checkpoints: exact to go on from, whenever they were taken, and refused when they are not what they should be.

#include "pathscope/session/checkpoint.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <string>

#include "pathscope/core/files.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/wire/codec.hpp"
#include "session/checkpoint_frames.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr SamplingRule k_rules[] = {{false, 0}, {true, 0}, {false, 0.02}, {true, 0.02}};

void check_same_light(const FrameWork& a, const FrameWork& b) {
    for (const auto& [of_a, of_b] :
         {std::pair(&a.direct(), &b.direct()), std::pair(&a.indirect(), &b.indirect())}) {
        CHECK(std::equal(of_a->sums().begin(), of_a->sums().end(), of_b->sums().begin(), of_b->sums().end()));
        for (std::uint32_t block = 0; block < of_a->grid().count(); ++block)
            CHECK(of_a->samples_of_block(block) == of_b->samples_of_block(block));
    }
    CHECK(a.passes_finished() == b.passes_finished());
    CHECK(a.estimated_error() == b.estimated_error());
    CHECK(a.direct_progress() == b.direct_progress());
    CHECK(a.indirect_progress() == b.indirect_progress());
    CHECK(a.complete() == b.complete());
}

/// The same bytes under a seal that fits them: what somebody would make who means it.
std::string sealed_again(std::string file) {
    const std::size_t sealed = file.size() - Digest{}.size();
    const Digest seal = hash_text(std::string_view(file).substr(0, sealed));
    std::copy(seal.begin(), seal.end(), file.begin() + std::ptrdiff_t(sealed));
    return file;
}

/// A frame half way, with passes in the second of them.
Checkpoint some_checkpoint(const SamplingRule& rule) {
    MadeUpFrame frame(checkpoint_plan(rule));
    HashRng rng(5);
    while (rule.staged() && frame.work.passes_finished() == 0) frame.advance(rng, 10);
    frame.advance(rng, rule.staged() ? 20 : 150);
    return frame.checkpoint();
}

std::string refusal(const SamplingRule& rule, const std::string& file) {
    MadeUpFrame frame(checkpoint_plan(rule));
    const auto resumed = frame.resume(file);
    CHECK(!resumed);
    return resumed ? "" : resumed.error().message;
}

}  // namespace

TEST_CASE(
    "a client killed at any moments ends with the bits of one that never was, each round committed once") {
    for (const SamplingRule& rule : k_rules) {
        CAPTURE(rule.adaptive);
        CAPTURE(rule.target_error);
        const WorkPlan plan = checkpoint_plan(rule);
        MadeUpFrame calm(plan);
        calm.finish();
        if (rule.staged()) REQUIRE(calm.work.passes_finished() > 2);
        for (std::uint32_t seed = 1; seed <= (k_sanitized ? 4 : 20); ++seed) {
            CAPTURE(seed);
            HashRng rng(seed);
            std::string file = MadeUpFrame(plan).file();
            WorkPlan other = plan;
            for (int life = 0; life < 4; ++life) {
                other.schedule = ScheduleKind(rng.next_u32() % 3);
                other.order = UnitOrder(rng.next_u32() % 2);
                MadeUpFrame frame(other);
                REQUIRE(bool(frame.resume(file)));
                frame.advance(rng, int(rng.next_u32() % 300));
                file = frame.file();
                frame.advance(rng, 20);  // Lost with its client.
            }
            MadeUpFrame last(plan);
            REQUIRE(bool(last.resume(file)));
            last.finish();
            check_same_light(last.work, calm.work);
            CHECK(last.samples_merged == calm.samples_merged);
            CHECK(last.store.total(Counter::rounds_committed) == last.store.total(Counter::rounds));
            CHECK(last.work.indirect_ledger().rounds_committed() ==
                  calm.work.indirect_ledger().rounds_committed());
            CHECK(bool(last.work.indirect_ledger().check_invariants()));
        }
    }
}

TEST_CASE("what is taken up is what there was: the file of it has the same bytes") {
    for (const SamplingRule& rule : k_rules)
        for (std::uint32_t seed = 1; seed <= 20; ++seed) {
            MadeUpFrame before(checkpoint_plan(rule)), after(checkpoint_plan(rule));
            HashRng rng(seed);
            before.advance(rng, int(rng.next_u32() % 600));
            REQUIRE(bool(after.resume(before.file())));
            check_same_light(before.work, after.work);
            CHECK(before.file() == after.file());
            CHECK(bool(after.work.indirect_ledger().check_invariants()));
            CHECK(after.store.total(Counter::samples) == before.samples_merged);
            CHECK(after.store.server(k_local_server)->total(Counter::samples) == 0);  // It did nothing yet.
        }
}

TEST_CASE("a frame that was stopped in the middle of a pass goes on with it") {
    for (const SamplingRule& rule : k_rules) {
        MadeUpFrame calm(checkpoint_plan(rule)), stopped(checkpoint_plan(rule)), last(checkpoint_plan(rule));
        calm.finish();
        HashRng rng(3);
        stopped.advance(rng, 200);
        stopped.work.stop();
        stopped.advance(rng, 500);
        REQUIRE(bool(last.resume(stopped.file())));
        last.finish();
        check_same_light(last.work, calm.work);
    }
}

TEST_CASE("header and history come back") {
    Checkpoint checkpoint = some_checkpoint({true, 0.02});
    checkpoint.history = {3, 12.5, 4, 5, 6, 7, 8, 9, {{1, 2, 3}, {4, 5, 6}}, 2};
    const auto file = CheckpointFile::parse(encode_checkpoint(checkpoint), "f.ck");
    REQUIRE(bool(file));
    const WorkHistory& history = file->history();
    CHECK(history.runs == 3);
    CHECK(history.render_s == 12.5);
    CHECK(history.rounds == 4);
    CHECK(history.tiles == 5);
    CHECK(history.rays == 6);
    CHECK(history.samples == 7);
    CHECK(history.nonfinite_dropped == 8);
    CHECK(history.saturated == 9);
    CHECK(history.differing_rounds == 2);
    CHECK(history.dropped == std::vector<DroppedSample>{{1, 2, 3}, {4, 5, 6}});
    CHECK(!difference(file->work(), checkpoint.work));
}

TEST_CASE("each damaged byte and each missing end is found") {
    const std::string good = encode_checkpoint(some_checkpoint({true, 0}));
    REQUIRE(bool(CheckpointFile::parse(good, "f.ck")));
    for (std::size_t at = 0; at < good.size(); ++at) {
        std::string bad = good;
        bad[at] = char(bad[at] ^ (1 << at % 8));
        const auto file = CheckpointFile::parse(std::move(bad), "f.ck");
        REQUIRE(!file);
        REQUIRE(file.error().message.starts_with("f.ck is "));
        REQUIRE(file.error().kind == ErrorKind::bad_input);
        REQUIRE(!CheckpointFile::parse(good.substr(0, at), "f.ck"));
    }
    CHECK(!CheckpointFile::parse(good + '\0', "f.ck"));
    CHECK(CheckpointFile::parse("a letter to my mother", "f.ck").error().message == "f.ck is no checkpoint.");
    CHECK(CheckpointFile::read("none.ck").error().message.find("none.ck") != std::string::npos);
}

TEST_CASE("whatever a file with a right seal says, nothing breaks") {
    for (const SamplingRule& rule : k_rules) {
        const std::string good = encode_checkpoint(some_checkpoint(rule));
        HashRng rng(9);
        for (int i = 0; i < (k_sanitized ? 500 : 2000); ++i) {
            std::string bad = good;
            for (std::uint32_t changes = 1 + rng.next_u32() % 3; changes > 0; --changes)
                bad[rng.next_u32() % bad.size()] = char(rng.next_u32());
            if (rng.next_u32() % 4 == 0) bad.resize(64 + rng.next_u32() % (bad.size() - 64));
            MadeUpFrame frame(checkpoint_plan(rule));
            if (!frame.resume(sealed_again(bad))) continue;
            REQUIRE(bool(frame.work.indirect_ledger().check_invariants()));
            frame.finish();
        }
    }
}

TEST_CASE("what cannot be is refused under a right seal as well") {
    using Lie = std::function<void(Checkpoint&)>;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const Lie lies[] = {
        [](Checkpoint& c) { c.frame.indirect.sums[7].g = -1; },
        [](Checkpoint& c) { c.frame.direct.sums[0].r = std::numeric_limits<std::int64_t>::max(); },
        [](Checkpoint& c) { c.frame.direct.sums.pop_back(); },
        [](Checkpoint& c) { c.frame.indirect.units[3].reached = 1u << 30; },
        [](Checkpoint& c) {
            c.frame.indirect.units[2] = {1, {1}};
        },
        [](Checkpoint& c) {
            c.frame.indirect.units[2] = {2, {1, 0}};
        },
        [](Checkpoint& c) {
            c.frame.indirect.units[2] = {2, {0, 0}};
        },
        [](Checkpoint& c) { c.frame.indirect.units.pop_back(); },
        [](Checkpoint& c) { c.frame.passes_finished = 0xffff'ffff; },
        [](Checkpoint& c) { c.frame.last_pass_finished = !c.frame.last_pass_finished; },
        [](Checkpoint& c) { c.history.render_s = std::numeric_limits<double>::infinity(); },
    };
    const Lie staged_lies[] = {
        [](Checkpoint& c) { c.frame.direct.rounds[0] = 0; },
        [](Checkpoint& c) { c.frame.direct.rounds[0] = 1u << 31; },
        [](Checkpoint& c) { c.frame.indirect.rounds.pop_back(); },
        [](Checkpoint& c) { c.frame.indirect.variance.clear(); },
        [nan](Checkpoint& c) { c.frame.indirect.variance[0] = nan; },
        [](Checkpoint& c) { c.frame.indirect.variance[0] = -1; },
        [](Checkpoint& c) { c.frame.indirect.mean = -1; },
        [](Checkpoint& c) { c.frame.direct.scouts[1][0].b = -1; },
        [](Checkpoint& c) { c.frame.passes_finished = 0; },
        [](Checkpoint& c) { c.frame.indirect.samples = 39; },
        [](Checkpoint& c) { c.frame.direct = {}; },
    };
    for (const SamplingRule& rule : k_rules) {
        const Checkpoint truth = some_checkpoint(rule);
        const auto refuses = [&](const Lie& lie, std::ptrdiff_t which) {
            CAPTURE(which);
            Checkpoint lying = truth;
            lie(lying);
            CHECK(refusal(rule, encode_checkpoint(lying)).starts_with("f.ck"));
        };
        if (rule.staged()) REQUIRE(truth.frame.passes_finished > 0);
        for (const Lie& lie : lies) refuses(lie, &lie - lies);
        if (rule.staged())
            for (const Lie& lie : staged_lies) refuses(lie, &lie - staged_lies);
    }
}

TEST_CASE("another version is named as such") {
    std::string file = encode_checkpoint(some_checkpoint({}));
    file[8] = 2;
    CHECK(refusal({}, sealed_again(file)) ==
          "f.ck is a checkpoint of version 2; this program reads version 1.");
}

TEST_CASE("the bytes of a file have the order that the document says") {
    const std::string file = MadeUpFrame(checkpoint_plan()).file();
    CHECK(file.substr(0, 8) == "PATHSCKP");
    CHECK(file.substr(8, 4) == std::string("\1\0\0\0", 4));
    const auto byte = [&](std::size_t at) { return std::size_t(std::uint8_t(file[at])); };
    const std::size_t header = byte(12) | byte(13) << 8 | byte(14) << 16 | byte(15) << 24;
    const auto map = unpack(std::string_view(file).substr(16, header));
    REQUIRE(bool(map));
    CHECK(*map->get<PackMap>()->find("block") == PackValue(4));
    const auto document = read_file("docs/checkpoints.md");
    REQUIRE(bool(document));
    const auto is_documented = [&](const PackMap& fields) {
        for (const auto& [key, value] : fields.entries())
            CHECK_MESSAGE(document->find("`" + key + "`") != std::string::npos, key);
    };
    is_documented(*map->get<PackMap>());
    is_documented(*map->get<PackMap>()->find("direct")->get<PackMap>());
    CHECK(sealed_again(file) == file);

    // The arrays of direct light, small enough to be a piece each: reached, then (of none) missing, then sums.
    std::size_t at = 16 + header;
    for (const std::size_t words : {15, 18 * 11 * 3}) {
        const std::size_t size = byte(at) | byte(at + 1) << 8 | byte(at + 2) << 16 | byte(at + 3) << 24;
        const auto array = unpack_bytes(Codec(byte(at + 4)), file.substr(at + 5, size), words * 8);
        REQUIRE(bool(array));
        CHECK(*array == std::string(words * 8, '\0'));
        at += 5 + size;
    }
}

TEST_CASE(
    "a plain frame may go on to more samples, or to fewer, if its rounds are rounds of that frame too") {
    const auto state_with = [](std::uint32_t spp, std::uint32_t direct_spp) {
        RenderState state = checkpoint_state(checkpoint_plan());
        state.settings.spp = spp;
        state.settings.direct_spp = direct_spp;
        return state;
    };
    const WorkPlan plan = checkpoint_plan();  // Rounds of 4.
    const auto go_on = [&](const RenderState& from, int steps, const RenderState& to) -> std::string {
        MadeUpFrame first(plan, from), second(plan, to);
        HashRng rng(2);
        first.advance(rng, steps);
        if (const auto resumed = second.resume(first.file()); !resumed) return resumed.error().message;
        second.finish();
        MadeUpFrame expected(plan, to);
        expected.finish();
        check_same_light(second.work, expected.work);
        CHECK(second.samples_merged == expected.samples_merged);
        return "";
    };
    constexpr int k_to_the_end = 100'000;
    CHECK(go_on(state_with(12, 4), k_to_the_end, state_with(22, 8)).empty());
    CHECK(go_on(state_with(12, 4), 60, state_with(22, 8)).empty());
    CHECK(go_on(state_with(12, 0), k_to_the_end, state_with(12, 4)).empty());  // Direct light is new.
    CHECK(go_on(state_with(14, 5), 30, state_with(22, 8)).empty());  // No last round is committed yet.
    CHECK(
        go_on(state_with(k_max_samples_per_pixel, 4), 60, state_with(22, 8)).empty());  // As with --seconds.
    CHECK(go_on(state_with(14, 4), k_to_the_end, state_with(22, 8)).find("14") != std::string::npos);
    CHECK(go_on(state_with(12, 4), k_to_the_end, state_with(11, 4)).find("--round (4)") != std::string::npos);
    CHECK(go_on(state_with(12, 4), k_to_the_end, state_with(4, 4)).find("12") != std::string::npos);
    CHECK(!go_on(state_with(12, 4), k_to_the_end, state_with(12, 0)).empty());
}

TEST_CASE("other work is refused with its name") {
    MadeUpFrame before(checkpoint_plan());
    RenderState state = checkpoint_state(checkpoint_plan());
    state.settings.seed = 9;
    MadeUpFrame other(checkpoint_plan(), state);
    CHECK(other.resume(before.file()).error().message == "f.ck is of other work: its --seed is 1, not 9.");
    CHECK(refusal({true, 0}, before.file()) == "f.ck is of other work: its --adaptive is off, not on.");
}
