#include "pathscope/session/frame_work.hpp"

#include <algorithm>
#include <vector>

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr ServerId k_server{1};

/// 5 x 3 blocks, of which the last column and row are smaller; the last round of each is shorter.
RenderSettings small_frame() {
    RenderSettings settings;
    settings.width = 70;
    settings.height = 40;
    settings.spp = 10;
    settings.direct_spp = 3;
    settings.quantum = Quantum{0};
    return settings;
}

/// The work of a small frame, with one server to give rounds to. Times are all zero: nothing here expires.
struct SmallWork {
    EventStore store;
    FrameWork work{{.block_size = 16, .round_samples = 4, .can_undo = true}, store};

    explicit SmallWork(const RenderSettings& settings = small_frame()) { begin(settings, Epoch{1}); }

    std::vector<Lease> begin(const RenderSettings& settings, Epoch epoch) {
        std::vector<Lease> dropped = work.begin(settings, epoch, 0);
        work.set_servers({{k_server, 0}});
        return dropped;
    }
    std::optional<Lease> grant(LightPart part, std::uint32_t most = 1) {
        if (part == LightPart::direct) return work.grant_direct(0);
        return work.grant_indirect(k_server, 0, most,
                                   [](const Round&, std::uint32_t) { return k_second_ns; });
    }
    Verdict commit(LightPart part, const Lease& lease) {
        const ResultClaim claim{lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server};
        return work.commit(part, claim, light(lease), 0).verdict;
    }
    /// Sample s of block b has the radiance (s + 1) (b + 1): no two samples of a block can stand for each other.
    [[nodiscard]] std::vector<PixelSum> light(const Lease& lease) const {
        std::int64_t sum = 0;
        for (std::uint32_t s = lease.first; s < lease.first + lease.count; ++s)
            sum += std::int64_t(s + 1) * (lease.unit + 1);
        return std::vector<PixelSum>(std::size_t(work.round_of(lease).rect.area()),
                                     PixelSum{sum, 2 * sum, 0});
    }
    /// Commits a round of the part that is behind, or of the other if it has none; of which it was.
    LightPart advance() {
        LightPart part = work.direct_is_behind() ? LightPart::direct : LightPart::indirect;
        auto lease = grant(part);
        if (!lease) {
            part = part == LightPart::direct ? LightPart::indirect : LightPart::direct;
            lease = grant(part);
        }
        REQUIRE(lease);
        REQUIRE(commit(part, *lease) == Verdict::accepted);
        return part;
    }
    /// Commits all rounds that there are; how many.
    int finish(LightPart part) {
        int rounds = 0;
        while (const auto lease = grant(part)) {
            REQUIRE(commit(part, *lease) == Verdict::accepted);
            ++rounds;
        }
        return rounds;
    }
};

bool is_black(const FrameSums& sums) {
    for (const Rgb& pixel : sums.mean().pixels)
        if (!(pixel == Rgb{})) return false;
    return true;
}

}  // namespace

TEST_CASE("each sample of each block is granted once, and its light added once") {
    SmallWork frame;
    CHECK(frame.work.direct_progress() == 0);
    CHECK(frame.work.indirect_progress() == 0);
    CHECK(frame.finish(LightPart::direct) == 15);
    CHECK(frame.work.direct_complete());
    CHECK(!frame.work.complete());
    CHECK(frame.finish(LightPart::indirect) == 45);
    CHECK(frame.work.complete());
    CHECK(frame.work.direct_progress() == 1);
    CHECK(frame.work.indirect_progress() == 1);
    CHECK(bool(frame.work.indirect_ledger().check_invariants()));

    const BlockGrid& grid = frame.work.indirect().grid();
    const Image direct = frame.work.direct().mean(), indirect = frame.work.indirect().mean();
    for (std::uint32_t block = 0; block < grid.count(); ++block) {
        CHECK(frame.work.direct().samples_of_block(block) == 3);
        CHECK(frame.work.indirect().samples_of_block(block) == 10);
    }
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 70; ++x) {
            const float b = float(grid.block_at(x, y) + 1);
            REQUIRE(direct.at(x, y) == Rgb{2 * b, 4 * b, 0});        // mean of 1..3
            REQUIRE(indirect.at(x, y) == Rgb{5.5f * b, 11 * b, 0});  // mean of 1..10
        }
}

TEST_CASE("a result adds light if and only if it is accepted") {
    for (const LightPart part : {LightPart::direct, LightPart::indirect}) {
        SmallWork frame;
        const FrameSums& sums = part == LightPart::direct ? frame.work.direct() : frame.work.indirect();
        const auto first = frame.grant(part), second = frame.grant(part);
        REQUIRE(bool(first));
        REQUIRE(bool(second));
        CHECK(frame.commit(part, *first) == Verdict::accepted);
        const std::vector<Rgb> once = sums.mean().pixels;
        CHECK(!is_black(sums));
        CHECK(frame.commit(part, *first) == Verdict::duplicate);
        Lease forged = *second;
        forged.server = ServerId{7};
        CHECK(frame.commit(part, forged) == Verdict::mismatched);
        CHECK(sums.mean().pixels == once);
        CHECK(sums.samples_of_block(first->unit) == first->count);
        CHECK(sums.samples_of_block(second->unit) == 0);

        // The picture changes: what is under way belongs to the old one.
        const std::vector<Lease> dropped = frame.begin(small_frame(), Epoch{2});
        CHECK(dropped.size() == (part == LightPart::indirect ? 1 : 0));  // Only servers have to be told.
        CHECK(is_black(sums));
        CHECK(frame.commit(part, *second) == Verdict::stale_epoch);
        CHECK(is_black(sums));
        CHECK(sums.samples_of_block(second->unit) == 0);
        CHECK(frame.work.direct_progress() + frame.work.indirect_progress() == 0);
        CHECK(frame.finish(part) == (part == LightPart::direct ? 15 : 45));
    }
}

TEST_CASE("there is a picture once each block has a round of each part") {
    SmallWork frame;
    CHECK(!frame.work.has_image());
    frame.finish(LightPart::direct);
    for (int rounds = 0; rounds < 15; ++rounds) {
        CHECK(!frame.work.has_image());
        REQUIRE(frame.commit(LightPart::indirect, *frame.grant(LightPart::indirect)) == Verdict::accepted);
        CHECK(frame.work.indirect_progress() == doctest::Approx((rounds + 1) / 45.0));
    }
    CHECK(frame.work.has_image());
    CHECK(!frame.work.complete());
    frame.begin(small_frame(), Epoch{2});
    CHECK(!frame.work.has_image());
}

TEST_CASE(
    "however unlike the budgets of both parts, there is a picture after a round of each for each block") {
    constexpr std::uint32_t k_many = 1'000'000;
    for (const auto& [direct_spp, spp] :
         {std::pair{1u, k_open_ended}, {k_open_ended, 1u}, {2u, k_many}, {k_many, 2u}}) {
        CAPTURE(spp);
        RenderSettings settings = small_frame();
        settings.direct_spp = direct_spp;
        settings.spp = spp;
        SmallWork frame(settings);
        int rounds = 0;
        for (; !frame.work.has_image() && rounds < 1000; ++rounds) frame.advance();
        CHECK(rounds == 2 * 15);
    }
}

TEST_CASE("a part that has an end reaches it, round for round, beside one that goes on until it is stopped") {
    constexpr std::uint32_t k_rounds = 10;
    for (const LightPart ends : {LightPart::direct, LightPart::indirect}) {
        RenderSettings settings = small_frame();
        settings.direct_spp = ends == LightPart::direct ? 4 * k_rounds : k_open_ended;
        settings.spp = ends == LightPart::indirect ? 4 * k_rounds : k_open_ended;
        SmallWork frame(settings);
        std::uint32_t of_it = 0;
        for (std::uint32_t round = 0; round < 2 * k_rounds * 15; ++round) of_it += frame.advance() == ends;
        CHECK(of_it == k_rounds * 15);
        CHECK(frame.work.has_image());
    }
}

TEST_CASE(
    "a unit that is undone is black, its rounds are open again, and done again it holds the same light") {
    SmallWork frame;
    frame.finish(LightPart::indirect);
    const auto finished = frame.work.indirect().sums();
    const std::vector<PixelSum> before(finished.begin(), finished.end());
    CHECK(frame.work.undo(7, 0) == 3);
    CHECK(frame.work.undo(7, 0) == 0);
    CHECK(frame.work.indirect_ledger().check_invariants());
    CHECK_FALSE(frame.work.has_image());
    CHECK(frame.work.indirect_progress() == doctest::Approx(14.0 / 15));
    CHECK(frame.work.indirect().samples_of_block(7) == 0);
    const PixelRect rect = frame.work.rect_of(7);
    CHECK(frame.work.indirect().sum_at(rect.x, rect.y) == PixelSum{});
    CHECK(frame.work.indirect().sum_at(rect.x - 1, rect.y) != PixelSum{});

    CHECK(frame.finish(LightPart::indirect) == 3);
    CHECK(frame.work.indirect_ledger().check_invariants());
    const auto again = frame.work.indirect().sums();
    CHECK(std::vector<PixelSum>(again.begin(), again.end()) == before);
}

TEST_CASE("what another run brought stays when a unit is undone, and when the frame begins anew") {
    SmallWork first, frame;
    for (int i = 0; i < 20; ++i)
        REQUIRE(first.commit(LightPart::indirect, *first.grant(LightPart::indirect)) == Verdict::accepted);
    FrameSnapshot snapshot;
    first.work.snapshot(snapshot);
    REQUIRE(frame.work.restore(snapshot));
    const auto is_as_restored = [&] {
        const auto sums = frame.work.indirect().sums();
        return std::vector<PixelSum>(sums.begin(), sums.end()) == snapshot.indirect.sums &&
               frame.work.indirect_ledger().rounds_committed() == 20 &&
               frame.work.indirect_ledger().check_invariants();
    };
    CHECK(is_as_restored());
    CHECK(frame.finish(LightPart::indirect) == 25);
    for (std::uint32_t unit = 0; unit < frame.work.grid().count(); ++unit) frame.work.undo(unit, 0);
    CHECK(is_as_restored());
    CHECK(frame.finish(LightPart::indirect) == 25);
    frame.work.begin_anew(small_frame(), Epoch{2}, 0);
    frame.work.set_servers({{k_server, 0}});
    CHECK(is_as_restored());
    CHECK(frame.finish(LightPart::indirect) == 25);
}

TEST_CASE("a stopped frame grants nothing more, and is complete when nothing is outstanding") {
    SmallWork frame;
    const auto direct = frame.grant(LightPart::direct), indirect = frame.grant(LightPart::indirect);
    REQUIRE(bool(direct));
    REQUIRE(bool(indirect));
    frame.work.stop();
    CHECK(!frame.grant(LightPart::direct));
    CHECK(!frame.grant(LightPart::indirect));
    frame.work.release_direct(*direct, 0);
    CHECK(frame.work.direct_complete());
    CHECK(!frame.work.complete());
    CHECK(frame.commit(LightPart::indirect, *indirect) == Verdict::accepted);
    CHECK(frame.work.complete());
    CHECK(frame.work.indirect_progress() < 1);
    CHECK(frame.work.indirect().samples_of_block(indirect->unit) == indirect->count);
}

TEST_CASE("a part of no samples is complete at once, and no picture waits for it") {
    RenderSettings settings = small_frame();
    settings.spp = 0;
    SmallWork frame(settings);
    CHECK(!frame.grant(LightPart::indirect));
    CHECK(frame.work.indirect_progress() == 1);
    CHECK(!frame.work.complete());
    frame.finish(LightPart::direct);
    CHECK(frame.work.has_image());
    CHECK(frame.work.complete());
}

TEST_CASE(
    "the direct part of an indirect round is granted beside it: once, and only if the samples are the same") {
    RenderSettings settings = small_frame();
    settings.direct_spp = 8;
    settings.spp = 10;
    SmallWork frame(settings);
    int pairs = 0, alone = 0;
    while (const auto indirect = frame.grant(LightPart::indirect)) {
        const auto direct = frame.work.grant_direct_beside(*indirect, 0);
        CHECK_FALSE(frame.work.grant_direct_beside(*indirect, 0));
        if (direct) {
            CHECK(direct->unit == indirect->unit);
            CHECK(direct->first == indirect->first);
            CHECK(direct->count == indirect->count);
            CHECK(frame.commit(LightPart::direct, *direct) == Verdict::accepted);
        }
        ++(direct ? pairs : alone);
        CHECK(frame.commit(LightPart::indirect, *indirect) == Verdict::accepted);
    }
    CHECK(pairs == 2 * 15);  // 4 and 4 samples; the last 2 are indirect ones only.
    CHECK(alone == 15);
    CHECK(frame.work.complete());
}

TEST_CASE("direct rounds that were granted before are not granted beside an indirect one") {
    RenderSettings settings = small_frame();
    settings.direct_spp = settings.spp = 4;
    SmallWork frame(settings);
    CHECK(frame.finish(LightPart::direct) == 15);
    while (const auto indirect = frame.grant(LightPart::indirect))
        CHECK_FALSE(frame.work.grant_direct_beside(*indirect, 0));
}

TEST_CASE("a lease may hold all rounds of a block but its first, and the picture is the same") {
    RenderSettings settings = small_frame();
    settings.spp = 18;  // Rounds of 4, 4, 4, 4 and 2 samples.
    SmallWork one(settings), many(settings);
    CHECK(one.finish(LightPart::indirect) == 15 * 5);
    int leases = 0;
    std::uint32_t most = 0;
    while (const auto lease = many.grant(LightPart::indirect, 3)) {
        CHECK((lease->first > 0 || lease->count == 4));
        most = std::max(most, lease->count);
        REQUIRE(many.commit(LightPart::indirect, *lease) == Verdict::accepted);
        ++leases;
    }
    CHECK(most == 12);
    CHECK(leases == 15 * 3);  // 4 | 4 4 4 | 2
    CHECK(many.work.indirect_progress() == 1);
    for (int y = 0; y < settings.height; ++y)
        for (int x = 0; x < settings.width; ++x)
            CHECK(many.work.indirect().sum_at(x, y) == one.work.indirect().sum_at(x, y));
}
