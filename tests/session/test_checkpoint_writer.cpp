#include "pathscope/session/checkpoint_writer.hpp"

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "session/checkpoint_frames.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// The moment is far away: all that is to be waited for is the thread.
void wait_for_write(CheckpointWriter& writer) {
    while (!writer.due(monotonic_now() + 1000 * k_second_ns)) std::this_thread::yield();
}

}  // namespace

TEST_CASE("checkpoints come at their time, one after the other, and the last at the end") {
    const TemporaryFolder folder;
    const auto path = folder.path() / "f.ck";
    MadeUpFrame frame(checkpoint_plan());
    const auto fill = [&](Checkpoint& into) { into = frame.checkpoint(); };
    HashRng rng(1);

    const TimeNs begin = monotonic_now();
    CheckpointWriter writer(path, 5 * k_second_ns, begin);
    CHECK(!writer.due(begin + 4 * k_second_ns));
    CHECK(writer.due(begin + 5 * k_second_ns));
    CHECK(!std::filesystem::exists(path));
    for (int i = 1; i <= 3; ++i) {
        frame.advance(rng, 50);
        writer.begin(begin + 5 * i * k_second_ns, fill);
        wait_for_write(writer);
        CHECK(*read_file(path) == frame.file());
        CHECK(writer.next() >= begin + 5 * (i + 1) * k_second_ns);
    }
    frame.finish();
    CHECK(bool(writer.finish(fill)));
    CHECK(*read_file(path) == frame.file());
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("what cannot be written is said once, the last good file stays, and the rest goes on") {
    const TemporaryFolder folder;
    const auto place = folder.path() / "place", away = folder.path() / "away", path = place / "f.ck";
    std::filesystem::create_directory(place);
    MadeUpFrame frame(checkpoint_plan());
    const auto fill = [&](Checkpoint& into) { into = frame.checkpoint(); };
    CheckpointWriter writer(path, k_second_ns, 0);
    const auto write = [&] {
        writer.begin(monotonic_now(), fill);
        wait_for_write(writer);
    };
    LogCapture log;
    write();
    const std::string good = *read_file(path);
    std::filesystem::rename(place, away);
    write();
    write();
    REQUIRE(log.warnings.size() == 1);
    CHECK(log.warnings[0].find("f.ck: No such file or directory. Rendering goes on") != std::string::npos);
    CHECK(*read_file(away / "f.ck") == good);
    CHECK(writer.finish(fill).error().message.find("f.ck") != std::string::npos);
    std::filesystem::rename(away, place);
    write();
    CHECK(log.warnings.size() == 1);
    CHECK(log.notes.size() == 1);
    CHECK(bool(writer.finish(fill)));
}

TEST_CASE("what a killed program left half written is removed, and nothing else") {
    const TemporaryFolder folder;
    for (const char* name : {"f.ck", "f.ck.part12-0", "f.ck.part1-33", "f.ck.part", "f.ck.part1",
                             "f.ck.part1-", "f.ck.party-1", "g.ck.part1-0"})
        REQUIRE(bool(write_file_atomically(folder.path() / name, "x")));
    const CheckpointWriter writer(folder.path() / "f.ck", k_second_ns, 0);
    CHECK(!std::filesystem::exists(folder.path() / "f.ck.part12-0"));
    CHECK(!std::filesystem::exists(folder.path() / "f.ck.part1-33"));
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 6);
}
