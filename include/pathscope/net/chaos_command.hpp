#pragma once
/// Faults as words: what is typed, scheduled in a file, or said by the window.
///
///     command   = "fault" fault *scope
///     fault     = "delay" TIME ["jitter" TIME]   ; each chunk takes TIME, and up to the jitter longer
///               / "rate" (RATE / "off")          ; at most so many bytes per second, in each direction
///               / "flip" P                       ; one bit of a byte, with this probability per byte
///               / "black-hole" ("on" / "off")    ; nothing comes through, nothing ends
///               / "cut"                          ; connections are reset; new ones are welcome
///               / "half-close"                   ; an end of stream; what comes later is dropped
///               / "refuse" ("on" / "off")        ; new connections are reset at once
///               / "clear"                        ; a good line again
///     scope     = "up" / "down" / "both"         ; up: from who dialled towards the target. both if not said
///               / "link" N / "port" N            ; N-th link, from 1; or by the port that listens. Else all
///     TIME      = number ("us" / "ms" / "s")     ; up to one hour
///     RATE      = number ("B/s" / "kB/s" / "MB/s" / "GB/s")   ; decimal, at least 1 B/s
///
/// delay, rate, flip and black-hole stay until they are changed, for connections that stand and those to
/// come; cut and half-close happen once. A schedule has lines `TIME command`, times counted from the start;
/// `#` opens a comment.
/// Thread safety: yes.   Test: tests/net/test_chaos_command.cpp

#include <array>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope {

namespace fault {
struct Delay {
    TimeNs delay = 0, jitter = 0;
};
struct Rate {
    double bytes_per_second = 0;  ///< 0: no limit.
};
struct Flip {
    double probability = 0;
};
struct BlackHole {
    bool on = false;
};
struct Cut {};
struct HalfClose {};
struct Refuse {
    bool on = false;
};
struct Clear {};
}  // namespace fault

using ChaosFault = std::variant<fault::Delay, fault::Rate, fault::Flip, fault::BlackHole, fault::Cut,
                                fault::HalfClose, fault::Refuse, fault::Clear>;

struct ChaosCommand {
    ChaosFault fault;
    std::array<bool, 2> directions{true, true};  ///< up, down
    std::optional<int> link;                     ///< From 1.
    std::optional<int> port;
};

struct ScheduledChaos {
    TimeNs at = 0;  ///< Since the start.
    ChaosCommand command;
    int line = 0;  ///< Of the file, from 1.
};

[[nodiscard]] Result<ChaosCommand> parse_chaos_command(std::string_view text);

/// The lines of a schedule in the order of their times, and of the file where those are equal. An error
/// begins with the line's number.
[[nodiscard]] Result<std::vector<ScheduledChaos>> parse_chaos_schedule(std::string_view text);

}  // namespace pathscope
