#pragma once
/// A TCP relay that misbehaves on command: delay, jitter, rate limit, cut, half-close, black hole, flipped
/// bytes.
///
///     who dials ──► listens on port A ══ up ══►  connects to port A' ──► target
///                                     ◄═ down ══
///
///     auto relay = ChaosRelay::create({.listen_ports = {6555, 6556}, .target_ports = {5555, 5556}});
///     std::thread loop([&] { (*relay)->run(monotonic_now); });
///     (*relay)->apply("fault delay 80ms jitter 20ms");       // any thread
///     (*relay)->request_stop();
///
/// Why: the kernel's own fault injection (netem) wants root and often is not there. A link is a pair of
/// ports. What a bad line does to bytes is chaos_stream.hpp, without sockets and clock; what may be
/// commanded is chaos_command.hpp. Here they meet sockets and time:
///   cut         both sockets are closed with SO_LINGER 0, so that both peers see a reset (RST)
///   half-close  the bytes under way arrive, then an end of stream (FIN); what is sent later is read and dropped
///   refuse      a new connection is taken and reset at once, so that the port stays ours
/// An end of stream on one side travels to the other behind the bytes, with their delay. A reset on one side
/// is passed on at once. A target that nobody listens at resets who dialled.
///
/// Bounds: per connection and direction at most `buffer_bytes` are held, at most `most_connections` stand;
/// beyond, senders and diallers wait. So memory is at most 2 most_connections (buffer_bytes + 320 KiB), and
/// the kernel's is 2 MiB per connection.
/// Determinism: the seed of each stream is a hash of (seed, link, number of the connection on its link,
/// direction).
/// Requires: loopback to listen on, or `open_to_others`: a client that admits this machine only would else
/// be open to all through the relay.
/// Thread safety: run() in one thread; all else from any; request_stop() from signal handlers too.
/// Test: tests/net/test_chaos_relay.cpp, tests/system/test_chaos.py

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/net/chaos_command.hpp"
#include "pathscope/net/chaos_stream.hpp"

namespace pathscope {

struct ChaosRelayConfig {
    std::string listen_host = "127.0.0.1";
    std::vector<int> listen_ports = {};  ///< 0: any free one.
    std::string target_host = "127.0.0.1";
    std::vector<int> target_ports = {};  ///< As many.
    bool open_to_others = false;
    std::uint64_t seed = 1;
    std::size_t buffer_bytes = ChaosStream::k_default_capacity;
    std::size_t most_connections = 1024;
};

struct ChaosLinkStats {
    int port = 0, target_port = 0;
    std::uint64_t connections = 0;  ///< Taken, refused ones not among them.
    std::uint64_t open = 0;         ///< Of these, standing.
    std::uint64_t cuts = 0;         ///< Connections ended by `fault cut`.
    std::uint64_t resets = 0;       ///< Connections that a peer reset.
    std::uint64_t refused = 0, unreachable = 0;
    std::array<std::uint64_t, 2> half_closes{};  ///< up, down
    std::array<ChaosCounts, 2> directions{};     ///< up, down
};

struct ChaosRelayStats {
    std::uint64_t commands = 0;  ///< That have taken effect.
    std::vector<ChaosLinkStats> links;
};

class ChaosRelay {
  public:
    /// Listens; nothing is taken before run().
    [[nodiscard]] static Result<std::unique_ptr<ChaosRelay>> create(const ChaosRelayConfig& config);
    ~ChaosRelay();

    /// Relays until request_stop(), then closes all connections. now: monotonic_now, by the clock of ppoll().
    void run(TimeNs (*now)());
    void request_stop() noexcept;

    /// Refuses a link or port that is not there.
    [[nodiscard]] Result<void> check(const ChaosCommand& command) const;

    /// Takes effect at once, in the order of the calls. Refuses what check() does.
    [[nodiscard]] Result<void> apply(const ChaosCommand& command);
    [[nodiscard]] Result<void> apply(std::string_view command);

    [[nodiscard]] const std::vector<int>& ports() const;
    [[nodiscard]] ChaosRelayStats stats() const;

  private:
    struct State;
    explicit ChaosRelay(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace pathscope
