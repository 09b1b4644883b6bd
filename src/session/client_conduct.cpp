#include <fmt/format.h>

#include <algorithm>

#include "pathscope/core/log.hpp"
#include "pathscope/session/client_machine.hpp"

namespace pathscope {
namespace {

/// Of a ban's rest, in the whole milliseconds that REJECT holds. Never 0, which would mean "for good".
std::uint32_t retry_ms_of(TimeNs left) {
    constexpr TimeNs k_longest = 3'600'000;
    return std::uint32_t(std::clamp<TimeNs>((left + k_millisecond_ns - 1) / k_millisecond_ns, 1, k_longest));
}

}  // namespace

/// Books an offence. The server, if it is one, may be gone afterwards: to be the last that is done about a message.
void ClientMachine::offend(const std::string& who, Offence offence) {
    if (const auto ban = conduct_.report(who, offence, now_)) shut_out(who, *ban);
}

/// Tells all that are known by that name, and gives them up. Who is no server yet, or no more, finds out by its HELLO.
void ClientMachine::shut_out(const std::string& who, const Ban& ban) {
    const std::string sentence = ban_sentence(ban, now_);
    std::vector<std::string> banned;
    for (const auto& [known_as, server] : servers_)
        if (server.who == who) banned.push_back(known_as);
    if (banned.empty()) {
        log_warning(fmt::format("Banned is {}: {}", who, sentence));
        store_.count(Counter::banned, 1);
    }
    for (const std::string& known_as : banned) {
        const Server& server = servers_.at(known_as);
        log_warning(fmt::format("{} is banned: {}", server.name, sentence));
        store_.count(Counter::banned, 1, server.peer.id());
        reject_banned(known_as, ban);
        lose(known_as, PeerCause::lost, sentence);
    }
}

void ClientMachine::reject_banned(const std::string& instance, const Ban& ban) {
    send(Channel::monitor, instance,
         message::Reject{RejectCode::banned, ban_sentence(ban, now_), retry_ms_of(ban.left(now_))});
}

}  // namespace pathscope
