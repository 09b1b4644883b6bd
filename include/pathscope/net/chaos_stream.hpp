#pragma once
/// What a bad line does to one direction of one TCP connection: bytes in with a time, bytes out with due
/// times.
///
///     chunk i arrives at t_i:   due_i = max(due_(i-1), t_i + delay + jitter u_i),   u_i uniform in [0, 1)
///     bytes leave in order, none before it is due, and in any span of length T at most
///                               rate T + line_limit(rate).depth bytes
///     each byte has one bit, picked at random, flipped with probability p
///
/// Order: the maximum over what came before keeps it, as TCP does: a chunk that is lucky waits for the
/// unlucky one before it. With faults that stay as they are, delay <= due_i - t_i < delay + jitter still
/// holds for each. TCP repeats what is lost, so that loss is not offered: seen from above it is delay. A
/// black hole lets nothing out and forgets nothing, as a cable that is pulled and put back.
///
/// Back pressure: at most `capacity` bytes are held. room() says how many more fit; who has none leaves the
/// rest in the sender's socket, and TCP slows the sender down. Hence no more than capacity / delay flows, as
/// with any window.
///
/// Determinism: what is drawn depends on the seed alone: jitter on a chunk's number, flips on a byte's place
/// in the stream (so not on chunks). The same bytes in the same chunks at the same times meet the same
/// faults.
/// Units: nanoseconds, bytes, bytes per second.
/// Thread safety: none. No sockets, no clock: `now` is an argument and must not run backwards.
/// Test: tests/net/test_chaos_stream.cpp

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/token_bucket.hpp"
#include "pathscope/net/byte_queue.hpp"

namespace pathscope {

/// The limit of a line of that rate: its depth is what flows in 10 ms, and at least one byte.
[[nodiscard]] inline RateLimit line_limit(double bytes_per_second) {
    return {bytes_per_second, std::max(1.0, bytes_per_second * 0.01)};
}

/// The faults of one direction. By default there are none.
struct ChaosFaults {
    TimeNs delay = 0;             ///< Each chunk takes at least this long,
    TimeNs jitter = 0;            ///< and up to this much longer.
    double bytes_per_second = 0;  ///< At most; 0 is no limit.
    double flip_probability = 0;  ///< Per byte, in [0, 1].
    bool black_hole = false;
    bool operator==(const ChaosFaults&) const = default;
};

/// bytes_in = bytes_out + bytes_dropped + what is held, at any time.
struct ChaosCounts {
    std::uint64_t bytes_in = 0, bytes_out = 0, bytes_dropped = 0;
    std::uint64_t flips = 0;            ///< Bytes that left or will leave with one wrong bit.
    std::uint64_t most_held_bytes = 0;  ///< At any one time, by any one connection.

    void add(const ChaosCounts& other);
};

/// Random numbers of a seed, one after the other: the n-th is hash(seed + n), by the finaliser of SplitMix64
/// (Steele, Lea & Flood 2014).
class ChaosDraws {
  public:
    explicit ChaosDraws(std::uint64_t seed) : state_(seed) {}
    [[nodiscard]] std::uint64_t next();
    [[nodiscard]] double next_unit();  ///< Uniform in [0, 1), 53 bits.

  private:
    std::uint64_t state_;
};

class ChaosStream {
  public:
    static constexpr std::size_t k_default_capacity = 4 << 20;
    static constexpr std::size_t k_most_chunks =
        16 << 10;  ///< Held at a time, so that tiny ones are bounded too.

    explicit ChaosStream(std::uint64_t seed, std::size_t capacity = k_default_capacity);

    /// Holds for bytes that come, and for those under way as far as they get through earlier by it: none
    /// waits longer than the new delay and jitter allow.
    void set_faults(const ChaosFaults& faults, TimeNs now);

    /// How many bytes push() takes; 0: leave them where they are and come back when some have left.
    [[nodiscard]] std::size_t room() const;

    /// One chunk. After end() it is dropped, and counted.
    /// Requires: bytes.size() <= room().
    void push(std::span<const std::byte> bytes, TimeNs now);

    /// The end of the stream follows the bytes, with the delay of a chunk. Once; later ones say nothing new.
    void end(TimeNs now);

    /// The front of what may leave at `now`; to be called again after pop(), until it is empty.
    [[nodiscard]] std::span<const std::byte> ready(TimeNs now) const;

    /// `count` bytes of ready(now) have left.
    void pop(std::size_t count, TimeNs now);

    /// Whether everything has left, and the end is due as well.
    [[nodiscard]] bool finished(TimeNs now) const;

    /// When ready() or finished() will have something, if nothing else happens: `now` or later, or never.
    [[nodiscard]] std::optional<TimeNs> next_due(TimeNs now) const;

    /// Drops what is held: its connection is gone.
    void abandon();

    [[nodiscard]] const ChaosCounts& counts() const { return counts_; }
    [[nodiscard]] std::size_t held_bytes() const { return queue_.size(); }

  private:
    struct Chunk {
        std::uint64_t end;  ///< Place in the stream behind its last byte.
        TimeNs due;
    };

    TimeNs draw_due(TimeNs now);
    void draw_next_flip(std::uint64_t from);
    void flip_bytes(std::uint64_t begin, std::uint64_t end);
    std::size_t worth_sending() const;

    std::size_t capacity_;
    ChaosFaults faults_;
    ChaosDraws jitter_draws_, flip_draws_;
    ByteQueue queue_;
    std::deque<Chunk> chunks_;
    TokenBucket bucket_;
    std::uint64_t taken_ = 0,
                  left_ = 0;  ///< Places in the stream: of the back and of the front of the queue.
    std::uint64_t next_flip_;
    TimeNs last_due_;
    std::optional<TimeNs> end_due_;
    ChaosCounts counts_;
};

}  // namespace pathscope
