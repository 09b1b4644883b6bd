#include "pathscope/net/chaos_command.hpp"

#include <string>

#include "testing.hpp"

using namespace pathscope;

namespace {

template <class Fault>
Fault parsed(std::string_view text) {
    const auto command = parse_chaos_command(text);
    REQUIRE_MESSAGE(bool(command), text);
    REQUIRE(std::holds_alternative<Fault>(command->fault));
    return std::get<Fault>(command->fault);
}

std::string refused(std::string_view text) {
    const auto command = parse_chaos_command(text);
    CAPTURE(text);
    REQUIRE_FALSE(bool(command));
    CHECK(command.error().kind == ErrorKind::bad_input);
    return command.error().message;
}

bool has(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("each fault as words") {
    CHECK(parsed<fault::Delay>("fault delay 80ms jitter 20ms").delay == 80 * k_millisecond_ns);
    CHECK(parsed<fault::Delay>("fault delay 80ms jitter 20ms").jitter == 20 * k_millisecond_ns);
    CHECK(parsed<fault::Delay>("  fault\tdelay  1.5s \r").delay == 1500 * k_millisecond_ns);
    CHECK(parsed<fault::Delay>("fault delay 20us").jitter == 0);
    CHECK(parsed<fault::Rate>("fault rate 1MB/s").bytes_per_second == 1e6);
    CHECK(parsed<fault::Rate>("fault rate 2.5kB/s").bytes_per_second == 2500);
    CHECK(parsed<fault::Rate>("fault rate off").bytes_per_second == 0);
    CHECK(parsed<fault::Flip>("fault flip 1e-6").probability == 1e-6);
    CHECK(parsed<fault::Flip>("fault flip off").probability == 0);
    CHECK(parsed<fault::BlackHole>("fault black-hole on").on);
    CHECK_FALSE(parsed<fault::BlackHole>("fault black-hole off").on);
    CHECK(parsed<fault::Refuse>("fault refuse on").on);
    parsed<fault::Cut>("fault cut");
    parsed<fault::HalfClose>("fault half-close up");
    parsed<fault::Clear>("fault clear");
}

TEST_CASE("scopes") {
    const auto all = parse_chaos_command("fault cut");
    CHECK(all->directions == std::array{true, true});
    CHECK_FALSE(all->link);
    CHECK_FALSE(all->port);
    const auto one = parse_chaos_command("fault half-close up link 2");
    CHECK(one->directions == std::array{true, false});
    CHECK(one->link == 2);
    const auto other = parse_chaos_command("fault rate 1MB/s port 5556 down");
    CHECK(other->directions == std::array{false, true});
    CHECK(other->port == 5556);
    CHECK(parse_chaos_command("fault clear both")->directions == std::array{true, true});
}

TEST_CASE("what is wrong is named") {
    CHECK(has(refused(""), "''"));
    CHECK(has(refused("delay 80ms"), "'delay'"));
    CHECK(has(refused("fault"), "no fault"));
    CHECK(has(refused("fault loss 1"), "'loss'"));
    for (const char* time :
         {"", "80", "ms", "80 ms", "-1ms", "nans", "infs", "1e300s", "2h", "3601s", "80mss"})
        CHECK(has(refused(std::string("fault delay ") + time), "no time"));
    CHECK(has(refused("fault delay 1s jitter"), "no time"));
    CHECK(has(refused("fault delay 1s 2s"), "'2s'"));
    for (const char* rate : {"", "0B/s", "0.5B/s", "1MB", "-1kB/s", "infB/s", "1e300GB/s"})
        CHECK(has(refused(std::string("fault rate ") + rate), "no rate"));
    for (const char* p : {"", "-0.1", "1.1", "nan", "1%"})
        CHECK(has(refused(std::string("fault flip ") + p), "no probability"));
    CHECK(has(refused("fault black-hole"), "neither on nor off"));
    CHECK(has(refused("fault refuse maybe"), "'maybe'"));
    CHECK(has(refused("fault cut up"), "both directions"));
    CHECK(has(refused("fault refuse on down"), "both directions"));
    CHECK(has(refused("fault cut link"), "link"));
    CHECK(has(refused("fault cut link 0"), "'0'"));
    CHECK(has(refused("fault cut port 70000"), "'70000'"));
    CHECK(has(refused("fault clear everything"), "'everything'"));
}

TEST_CASE("a schedule: times, comments, order, and errors with their line") {
    const auto schedule = parse_chaos_schedule(
        "# begin gently\n\n1s fault delay 5ms  # both ways\r\n500ms fault cut\n1s fault clear");
    REQUIRE(bool(schedule));
    REQUIRE(schedule->size() == 3);
    CHECK((*schedule)[0].at == 500 * k_millisecond_ns);
    CHECK((*schedule)[0].line == 4);
    CHECK(std::holds_alternative<fault::Cut>((*schedule)[0].command.fault));
    CHECK(std::holds_alternative<fault::Delay>((*schedule)[1].command.fault));
    CHECK(std::holds_alternative<fault::Clear>((*schedule)[2].command.fault));
    CHECK(parse_chaos_schedule("")->empty());

    CHECK(has(parse_chaos_schedule("1s fault cut\n\nsoon fault cut").error().message, "line 3: 'soon'"));
    CHECK(has(parse_chaos_schedule("1s fault loss").error().message, "line 1: 'loss'"));
    CHECK(has(parse_chaos_schedule("1s").error().message, "line 1: ''"));
}
