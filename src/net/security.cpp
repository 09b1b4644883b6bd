#include "pathscope/net/security.hpp"

#include <fmt/format.h>
#include <zmq.h>

#include <cctype>
#include <cerrno>
#include <cstdint>

#include "context_state.hpp"
#include "pathscope/core/check.hpp"
#include "tcp.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_key_characters = 40, k_key_bytes = 32;

}  // namespace

KeyPair make_key_pair() {
    char public_key[k_key_characters + 1], secret_key[k_key_characters + 1];
    do {
        CHECK(zmq_curve_keypair(public_key, secret_key) == 0, zmq_strerror(errno));
    } while (std::isalnum(static_cast<unsigned char>(public_key[0])) == 0);
    return {public_key, secret_key};
}

Result<KeyPair> key_pair_of(const std::string& secret_key) {
    if (!is_key(secret_key))
        return bad_input("This is no secret key: a key is 40 characters, as --keygen writes them.");
    char public_key[k_key_characters + 1];
    CHECK(zmq_curve_public(public_key, secret_key.c_str()) == 0, zmq_strerror(errno));
    return KeyPair{public_key, secret_key};
}

bool is_key(std::string_view text) {
    static constexpr std::string_view k_z85 =
        "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#";
    if (text.size() != k_key_characters || text.find_first_not_of(k_z85) != std::string_view::npos)
        return false;
    std::uint8_t bytes[k_key_bytes];
    return zmq_z85_decode(bytes, std::string(text).c_str()) != nullptr;
}

Result<void> admit_only(const Context& context, const std::vector<std::string>& public_keys) {
    for (const std::string& key : public_keys)
        if (!is_key(key))
            return bad_input(
                fmt::format("'{}' is no public key: a key is 40 characters, as --keygen writes them.", key));
    std::unique_ptr<Doorkeeper>& doorkeeper = context.state()->doorkeeper;
    if (!doorkeeper) {
        auto started = Doorkeeper::start(context.state()->zmq);
        if (!started) return started.error();
        doorkeeper = std::move(*started);
    }
    doorkeeper->admit_only(public_keys);
    return {};
}

std::vector<RefusedKey> take_refused_keys(const Context& context) {
    const std::unique_ptr<Doorkeeper>& doorkeeper = context.state()->doorkeeper;
    return doorkeeper ? doorkeeper->take_refused() : std::vector<RefusedKey>();
}

bool reaches_other_machines(std::string_view endpoint) {
    if (!endpoint.starts_with("tcp://")) return false;
    const std::string_view address = endpoint.substr(6);
    std::string host(address.substr(0, address.rfind(':')));
    if (host == "localhost") return false;
    // By its number: the name of an interface or of a host may begin with "127." as well.
    if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
    const auto number = tcp_address_of_digits(host);
    return !number || !number->is_loopback();
}

}  // namespace pathscope
