#include "pathscope/session/refusal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace pathscope {

std::string refusal_at_client(const RefusedKey& refused) {
    return fmt::format("Refused a server at {}: its public key {} is not on the list (--allow).",
                       refused.address, refused.public_key);
}

std::string refusal_at_client(const Refusal& refusal, const std::string& own_key) {
    const auto why = [&]() -> std::string {
        switch (refusal.reason) {
            case RefusalReason::unlisted_key:
                return "its public key is not on the list (--allow).";
            case RefusalReason::wrong_key:
                return fmt::format(
                    "it takes another public key for this client's, which is {} (--server-key).", own_key);
            case RefusalReason::one_sided:
                return own_key.empty() ? "it wants encryption, and this client was started without --key."
                                       : "it speaks without encryption; it needs --key and --server-key.";
            case RefusalReason::no_zeromq:
                return "it speaks another language than a render server's.";
            case RefusalReason::broke_off:
                break;
        }
        return "it hung up, or kept silent, in the middle of the handshake.";
    };
    const std::string who =
        refusal.address.empty() ? "a connection" : fmt::format("a connection from {}", refusal.address);
    return fmt::format("Refused {}: {}", who, why());
}

std::string refusal_at_server(RefusalReason reason, const std::string& where, const Security& security) {
    const auto* keys = std::get_if<Dialler>(&security);
    const auto why = [&]() -> std::string {
        switch (reason) {
            case RefusalReason::unlisted_key:
                return fmt::format(
                    "it does not know this server's key. Its user may add this line to the file of "
                    "--allow: {}",
                    keys ? keys->keys.public_key : "");
            case RefusalReason::one_sided:
                return keys ? "it speaks without encryption. Start it with --key and --allow."
                            : "it wants encryption. Start this server with --key and --server-key.";
            case RefusalReason::wrong_key:
            case RefusalReason::no_zeromq:
                return "what answers there is no Pathscope client.";
            case RefusalReason::broke_off:
                break;
        }
        return keys ? "it hung up in the middle of the handshake. Most likely --server-key is not its public "
                      "key, "
                      "or it was started without --key."
                    : "it hung up in the middle of the handshake.";
    };
    return fmt::format("The client at {} refuses this server: {}", where, why());
}

std::optional<std::string> SaidOnce::say(const std::string& sentence, TimeNs now) {
    const auto found = said_.find(sentence);
    if (found != said_.end() && now < found->second.again_at) {
        ++found->second.unsaid;
        return std::nullopt;
    }
    if (found == said_.end() && said_.size() >= k_max_sentences) {
        std::erase_if(said_, [now](const auto& entry) { return now >= entry.second.again_at; });
        if (said_.size() >= k_max_sentences) return std::nullopt;
    }
    const int unsaid = found == said_.end() ? 0 : found->second.unsaid;
    said_.insert_or_assign(sentence, Said{now + k_pause});
    return unsaid == 0 ? sentence : fmt::format("{} ({} times more since.)", sentence, unsaid);
}

std::optional<std::string> Redial::on_refused(RefusalReason reason, const std::string& where,
                                              const Security& security, TimeNs now) {
    pause_ = std::clamp(2 * pause_, k_first_pause, k_longest_pause);
    next_ = now + pause_;
    const bool broke_off = reason == RefusalReason::broke_off;
    const bool is_news = !broke_off || broke_off_before_;
    broke_off_before_ = broke_off;
    return is_news ? said_.say(refusal_at_server(reason, where, security), now) : std::nullopt;
}

}  // namespace pathscope
