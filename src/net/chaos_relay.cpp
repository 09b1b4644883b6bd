#include "pathscope/net/chaos_relay.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <mutex>
#include <type_traits>
#include <utility>

#include "chaos_connection.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/clock.hpp"
#include "pathscope/net/wake_pair.hpp"
#include "tcp.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_read_bytes = 64 << 10;  ///< At a time, so that connections take turns.
constexpr int k_accepted_at_once = 64;
constexpr TimeNs k_breath_ns = 100 * k_millisecond_ns;  ///< When the process has no descriptor left.

struct Link {
    Descriptor listener;
    TcpAddress target;
    std::array<ChaosFaults, 2> faults{};
    bool refuses = false;
    std::vector<ChaosConnection> connections;
    ChaosLinkStats ended;  ///< Totals of connections that are over.
};

void count_ending(ChaosLinkStats& stats, ChaosEnding ending) {
    stats.cuts += ending == ChaosEnding::cut;
    stats.resets += ending == ChaosEnding::reset;
    stats.unreachable += ending == ChaosEnding::unreachable;
}

void add_counts(ChaosLinkStats& stats, const ChaosConnection& connection) {
    for (std::size_t d = 0; d < 2; ++d) stats.directions[d].add(connection.counts(d));
}

/// Connections that are over become part of the totals.
void remove_ended(Link& link) {
    std::erase_if(link.connections, [&](const ChaosConnection& connection) {
        if (connection.ending() == ChaosEnding::none) return false;
        count_ending(link.ended, connection.ending());
        add_counts(link.ended, connection);
        return true;
    });
}

ChaosLinkStats stats_of(const Link& link) {
    ChaosLinkStats stats = link.ended;
    stats.open = link.connections.size();
    for (const ChaosConnection& connection : link.connections) add_counts(stats, connection);
    return stats;
}

/// Changes what stays: the faults of one direction.
void change(ChaosFaults& faults, const ChaosFault& fault) {
    std::visit(
        [&](const auto& f) {
            using F = std::decay_t<decltype(f)>;
            if constexpr (std::is_same_v<F, fault::Delay>) {
                faults.delay = f.delay;
                faults.jitter = f.jitter;
            }
            if constexpr (std::is_same_v<F, fault::Rate>) faults.bytes_per_second = f.bytes_per_second;
            if constexpr (std::is_same_v<F, fault::Flip>) faults.flip_probability = f.probability;
            if constexpr (std::is_same_v<F, fault::BlackHole>) faults.black_hole = f.on;
            if constexpr (std::is_same_v<F, fault::Clear>) faults = {};
        },
        fault);
}

void apply_to(Link& link, const ChaosCommand& command, TimeNs now) {
    const ChaosFault& fault = command.fault;
    if (const auto* refuse = std::get_if<fault::Refuse>(&fault)) link.refuses = refuse->on;
    if (std::holds_alternative<fault::Clear>(fault) && command.directions[0] && command.directions[1])
        link.refuses = false;
    if (std::holds_alternative<fault::Cut>(fault)) {
        for (ChaosConnection& connection : link.connections) connection.cut();
        return remove_ended(link);
    }
    for (std::size_t d = 0; d < 2; ++d) {
        if (!command.directions[d]) continue;
        change(link.faults[d], fault);
        for (ChaosConnection& connection : link.connections) {
            connection.set_faults(d, link.faults[d], now);
            if (!std::holds_alternative<fault::HalfClose>(fault)) continue;
            connection.half_close(d, now);
            ++link.ended.half_closes[d];
        }
    }
}

/// A seed for each connection's two streams, which take it and the one after it.
std::uint64_t seed_of(std::uint64_t seed, std::size_t link, std::uint64_t number) {
    const std::uint64_t of_link = ChaosDraws(ChaosDraws(seed).next() + link).next();
    return ChaosDraws(of_link + number).next() << 1;
}

}  // namespace

struct ChaosRelay::State {
    State(const ChaosRelayConfig& configuration, WakePair pair)
        : config(configuration), wake(std::move(pair)), scratch(k_read_bytes) {}

    ChaosRelayConfig config;
    WakePair wake;
    std::vector<int> ports;
    std::atomic<bool> stopping{false};

    // Of the loop alone.
    std::vector<Link> links;
    std::vector<std::byte> scratch;
    TimeNs accept_after = 0;
    std::uint64_t applied = 0;

    // Of all threads.
    mutable std::mutex mutex;
    std::vector<ChaosCommand> commands;
    ChaosRelayStats published;

    Result<void> listen();
    void take_commands(TimeNs now);
    void publish();
    void wait(std::vector<pollfd>& polls, TimeNs now);
    void step(const std::vector<pollfd>& polls, TimeNs now);
    void accept(std::size_t number, TimeNs now);
    std::size_t connection_count() const;
};

Result<void> ChaosRelay::State::listen() {
    auto here = resolve_tcp(config.listen_host);
    if (!here) return here.error();
    if (!here->is_loopback() && !config.open_to_others)
        return bad_input(
            fmt::format("Other machines could reach {}, and through it {}. Add --insecure if the network is "
                        "trusted.",
                        config.listen_host, config.target_host));
    auto target = resolve_tcp(config.target_host);
    if (!target) return target.error();
    for (std::size_t i = 0; i < config.listen_ports.size(); ++i) {
        here->set_port(config.listen_ports[i]);
        target->set_port(config.target_ports[i]);
        auto listener = listen_tcp(*here);
        if (!listener) return listener.error();
        Link& link = links.emplace_back();
        link.listener = std::move(*listener);
        link.target = *target;
        link.ended.port = tcp_address_of(link.listener).port();
        link.ended.target_port = config.target_ports[i];
        ports.push_back(link.ended.port);
    }
    publish();
    return {};
}

void ChaosRelay::State::take_commands(TimeNs now) {
    std::vector<ChaosCommand> taken;
    {
        const std::lock_guard lock(mutex);
        taken.swap(commands);
    }
    for (const ChaosCommand& command : taken)
        for (std::size_t i = 0; i < links.size(); ++i) {
            const bool named = (!command.link || std::size_t(*command.link) == i + 1) &&
                               (!command.port || *command.port == ports[i]);
            if (named) apply_to(links[i], command, now);
        }
    applied += taken.size();
}

void ChaosRelay::State::publish() {
    const std::lock_guard lock(mutex);
    published.commands = applied;
    published.links.clear();
    for (const Link& link : links) published.links.push_back(stats_of(link));
}

std::size_t ChaosRelay::State::connection_count() const {
    std::size_t count = 0;
    for (const Link& link : links) count += link.connections.size();
    return count;
}

/// Fills `polls`, in the order in which step() reads them, and waits for a socket, the bell or the next byte
/// due.
void ChaosRelay::State::wait(std::vector<pollfd>& polls, TimeNs now) {
    std::optional<TimeNs> until;
    const auto not_later_than = [&](std::optional<TimeNs> moment) {
        if (moment && (!until || *moment < *until)) until = moment;
    };
    const bool full = connection_count() >= config.most_connections, breathless = now < accept_after;
    if (breathless) not_later_than(accept_after);

    polls.clear();
    polls.push_back({wake.pollable().descriptor, POLLIN, 0});
    for (const Link& link : links) {
        polls.push_back({full || breathless ? -1 : link.listener.get(), POLLIN, 0});
        for (const ChaosConnection& connection : link.connections) {
            const auto ends = connection.polls();
            polls.insert(polls.end(), ends.begin(), ends.end());
            not_later_than(connection.next_due(now));
        }
    }

    const TimeNs span = until ? std::max<TimeNs>(0, *until - now) : 0;
    const timespec timeout{span / k_second_ns, span % k_second_ns};
    const int ready = ::ppoll(polls.data(), polls.size(), until ? &timeout : nullptr, nullptr);
    CHECK(ready >= 0 || errno == EINTR, errno);
    if (ready < 0)
        for (pollfd& poll : polls) poll.revents = 0;
}

void ChaosRelay::State::step(const std::vector<pollfd>& polls, TimeNs now) {
    if (polls[0].revents != 0) wake.clear();
    std::size_t at = 1;
    for (std::size_t i = 0; i < links.size(); ++i) {
        const bool knocked = polls[at++].revents != 0;
        for (ChaosConnection& connection : links[i].connections) {
            connection.step(std::span<const pollfd, 2>(&polls[at], 2), scratch, now);
            at += 2;
        }
        remove_ended(links[i]);
        if (knocked) accept(i, now);
    }
}

void ChaosRelay::State::accept(std::size_t number, TimeNs now) {
    Link& link = links[number];
    for (int i = 0; i < k_accepted_at_once && connection_count() < config.most_connections; ++i) {
        Descriptor dialler = accept_tcp(link.listener);
        if (!dialler) {
            if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM)
                accept_after = now + k_breath_ns;
            return;
        }
        if (link.refuses) {
            reset_tcp(dialler);
            ++link.ended.refused;
            continue;
        }
        const std::uint64_t seed = seed_of(config.seed, number, link.ended.connections++);
        Descriptor target = begin_connect_tcp(link.target);
        if (!target) {
            reset_tcp(dialler);
            ++link.ended.unreachable;
            continue;
        }
        link.connections.emplace_back(std::move(dialler), std::move(target), seed, config.buffer_bytes);
        for (std::size_t d = 0; d < 2; ++d) link.connections.back().set_faults(d, link.faults[d], now);
    }
}

Result<std::unique_ptr<ChaosRelay>> ChaosRelay::create(const ChaosRelayConfig& config) {
    if (config.listen_ports.empty() || config.listen_ports.size() != config.target_ports.size())
        return bad_input(
            fmt::format("{} ports to listen on and {} to connect to: they must be as many, and one at least.",
                        config.listen_ports.size(), config.target_ports.size()));
    auto wake = WakePair::create();
    if (!wake) return wake.error();
    auto state = std::make_unique<State>(config, std::move(*wake));
    if (auto listening = state->listen(); !listening) return listening.error();
    return std::unique_ptr<ChaosRelay>(new ChaosRelay(std::move(state)));
}

ChaosRelay::ChaosRelay(std::unique_ptr<State> state) : state_(std::move(state)) {}
ChaosRelay::~ChaosRelay() = default;

void ChaosRelay::run(TimeNs (*now)()) {
    std::vector<pollfd> polls;
    while (!state_->stopping) {
        state_->take_commands(now());
        state_->publish();
        state_->wait(polls, now());
        state_->step(polls, now());
    }
    for (Link& link : state_->links) {
        for (ChaosConnection& connection : link.connections) connection.close();
        remove_ended(link);
    }
    state_->publish();
}

void ChaosRelay::request_stop() noexcept {
    state_->stopping = true;
    state_->wake.notify();
}

Result<void> ChaosRelay::check(const ChaosCommand& command) const {
    const auto& ports = state_->ports;
    if (command.link && std::size_t(*command.link) > ports.size())
        return bad_input(
            fmt::format("There is no link {}; the last one is {}.", *command.link, ports.size()));
    if (command.port && std::find(ports.begin(), ports.end(), *command.port) == ports.end())
        return bad_input(fmt::format("No link listens on port {}.", *command.port));
    return {};
}

Result<void> ChaosRelay::apply(const ChaosCommand& command) {
    if (const auto fits = check(command); !fits) return fits.error();
    {
        const std::lock_guard lock(state_->mutex);
        state_->commands.push_back(command);
    }
    state_->wake.notify();
    return {};
}

Result<void> ChaosRelay::apply(std::string_view command) {
    const auto parsed = parse_chaos_command(command);
    return parsed ? apply(*parsed) : Result<void>(parsed.error());
}

const std::vector<int>& ChaosRelay::ports() const { return state_->ports; }

ChaosRelayStats ChaosRelay::stats() const {
    const std::lock_guard lock(state_->mutex);
    return state_->published;
}

}  // namespace pathscope
