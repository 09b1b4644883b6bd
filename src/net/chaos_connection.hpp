#pragma once
/// One connection through the chaos relay: two sockets and a ChaosStream in each direction.
///
///     end 0 (who dialled)  ── up: stream 0 ──►  end 1 (target)
///                          ◄─ down: stream 1 ──
///
/// Direction d reads from end d and writes to end 1 - d. It reads while its stream has room, and that is the
/// whole of the back pressure; its end of stream (FIN) is sent when its stream is finished. Both sent: the
/// connection is over.
/// Thread safety: that of the relay's loop, alone.   Test: tests/net/test_chaos_relay.cpp

#include <poll.h>

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "pathscope/net/chaos_stream.hpp"
#include "tcp.hpp"

namespace pathscope {

enum class ChaosEnding {
    none,         ///< It stands, or is being made.
    closed,       ///< Both directions came to their end.
    reset,        ///< A peer reset it, or went away.
    unreachable,  ///< Nobody listens at the target.
    cut,          ///< By command.
};

class ChaosConnection {
  public:
    /// `target` may still be connecting.
    ChaosConnection(Descriptor dialler, Descriptor target, std::uint64_t seed, std::size_t buffer_bytes);

    void set_faults(std::size_t direction, const ChaosFaults& faults, TimeNs now);
    void half_close(std::size_t direction, TimeNs now);
    void cut() { reset(ChaosEnding::cut); }
    void close();  ///< As it is: what is held is dropped.

    /// What to wait for at both ends.
    [[nodiscard]] std::array<pollfd, 2> polls() const;
    /// When to come back even if nothing happens at the sockets.
    [[nodiscard]] std::optional<TimeNs> next_due(TimeNs now) const;
    /// Reads, writes and ends what `polled`, an answered polls(), and the time allow.
    void step(std::span<const pollfd, 2> polled, std::span<std::byte> scratch, TimeNs now);

    [[nodiscard]] ChaosEnding ending() const { return ending_; }
    [[nodiscard]] const ChaosCounts& counts(std::size_t direction) const {
        return directions_[direction].stream.counts();
    }

  private:
    struct Direction {
        ChaosStream stream;
        bool input_over = false;   ///< The sender's end of stream was read.
        bool output_over = false;  ///< The receiver was sent an end of stream.
        bool blocked = false;      ///< The receiver's socket takes no more, or does not stand yet.
    };

    void finish_connecting();
    void read_from(std::size_t direction, std::span<std::byte> scratch, TimeNs now);
    void write_to(std::size_t direction, TimeNs now);
    void reset(ChaosEnding ending);

    std::array<Descriptor, 2> ends_;
    std::array<Direction, 2> directions_;
    bool connecting_ = true;
    ChaosEnding ending_ = ChaosEnding::none;
};

}  // namespace pathscope
