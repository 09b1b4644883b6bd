#pragma once
/// Connections as they come and go, told by ZeroMQ itself; on either side of them.
///
/// A process that dies closes its connection, and that is known here within milliseconds, long before
/// heartbeats miss it. ZeroMQ does not say whose connection it was: send each peer something, and the dead
/// one is `unreachable` (router.hpp). A machine that hangs or a cable that is cut closes nothing; that is
/// what heartbeats are for.
///
///     const ConnectionChanges changes = watch.take_changes();
///     if (changes.lost > 0) ping_all_servers();
///     for (const Refusal& refusal : changes.refusals) tell(refusal);
///
/// The reason of a refusal as each side sees it, with keys at one or both of them:
///
///     what is wrong                           listener sees      dialler sees
///     the dialler's key is not listed         unlisted_key       unlisted_key
///     the dialler knows another listener key  wrong_key          broke_off
///     only one of them has keys               one_sided          one_sided
///     no ZeroMQ, or an ancient one            no_zeromq          no_zeromq, broke_off
///     the line broke, or nobody spoke         broke_off          broke_off
///
/// Whoever notices first hangs up, and the other may then see no more than that: broke_off.
/// The address is known while the connection is open when its event is read, so often not for those that are refused
/// at once; and it is no more than a hint, for a descriptor may lead to the next connection by then. The
/// address of an unlisted key is known always: take_refused_keys() (security.hpp).
/// Requires: take_changes() is called every now and then, as events are kept until they are taken.
/// Thread safety: one thread, any, but the watch ends on the thread of the socket that it watches; which of the two
/// ends first does not matter.   Source: zmq_socket_monitor(3).
/// Test: tests/net/test_connection_watch.cpp, test_security.cpp

#include <array>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

enum class RefusalReason { unlisted_key, wrong_key, one_sided, no_zeromq, broke_off };

inline constexpr std::array k_refusal_reason_names{
    EnumName{RefusalReason::unlisted_key, "unlisted_key"}, EnumName{RefusalReason::wrong_key, "wrong_key"},
    EnumName{RefusalReason::one_sided, "one_sided"},       EnumName{RefusalReason::no_zeromq, "no_zeromq"},
    EnumName{RefusalReason::broke_off, "broke_off"},
};
constexpr const auto& enum_table(RefusalReason) { return k_refusal_reason_names; }

struct Refusal {
    RefusalReason reason;
    std::string address;  ///< Of the other machine, as a number; empty if it is not known.
    bool operator==(const Refusal&) const = default;
};

struct ConnectionChanges {
    int accepted = 0;                 ///< Connections that completed the handshake.
    int lost = 0;                     ///< Completed ones that ended, by either side or by a broken line.
    std::vector<Refusal> refusals{};  ///< Connections that ended without one.
    bool operator==(const ConnectionChanges&) const = default;
};

class ConnectionWatch {
  public:
    /// Of any of our sockets. Requires: it is not being watched already.
    template <class Socket>
    [[nodiscard]] static Result<ConnectionWatch> watch(const Context& context, const Socket& socket) {
        return watch_handle(context, socket.handle());
    }
    ConnectionWatch(ConnectionWatch&& other) noexcept = default;
    ConnectionWatch& operator=(ConnectionWatch&& other) noexcept;
    ~ConnectionWatch();

    /// What happened since the last call, of at most 1,000 events.
    [[nodiscard]] ConnectionChanges take_changes();

    [[nodiscard]] Pollable pollable() const { return {events_.get()}; }

  private:
    /// A connection whose handshake has neither succeeded nor failed.
    struct Newcomer {
        int descriptor;
        std::string address;
    };

    ConnectionWatch() = default;
    [[nodiscard]] static Result<ConnectionWatch> watch_handle(const Context& context,
                                                              const SocketHandle& watched);
    void take(int event, int value, ConnectionChanges& changes);
    void on_ended(int descriptor, ConnectionChanges& changes);

    std::weak_ptr<OpenSocket> watched_;
    SocketHandle events_;
    std::vector<Newcomer> newcomers_;   ///< In the order in which they came.
    std::deque<RefusalReason> failed_;  ///< Handshakes that failed and whose connection has not ended yet.
};

}  // namespace pathscope
