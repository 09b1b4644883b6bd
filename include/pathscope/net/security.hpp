#pragma once
/// CURVE: only who holds a listed key gets in, and nobody else can read or forge a byte.
///
/// Each side has a key pair. The listening side names the public keys it admits; the dialling side must know
/// the listener's public key, so that it cannot be lured to an impostor.
///
///     client:  admit_only(context, {server_public_key});
///              options.security = Listener{client_keys};
///     server:  options.security = Dialler{server_keys, client_public_key};
///
/// A connection without a right key never reaches the application: its handshake fails, and ConnectionWatch
/// counts it. Without security, bind only where reaches_other_machines() is false, or because the user
/// insisted.
/// Convention: keys are text of 40 characters (Z85).   Cost: about 1 ms per handshake; 0.4 GB/s instead of
/// 2.5.
/// Source: ZeroMQ RFCs 25 (CURVE), 26 (CurveZMQ), 27 (ZAP); Bernstein, "CurveCP".
/// Thread safety: yes.   Test: tests/net/test_security.cpp

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"

namespace pathscope {

struct KeyPair {
    std::string public_key, secret_key;
};

/// The public key begins with a letter or a digit, so that it looks like no flag and no comment.
[[nodiscard]] KeyPair make_key_pair();

/// The public key that belongs to a secret one; so a key file needs to hold the secret one only.
/// Refuses what is no key.
[[nodiscard]] Result<KeyPair> key_pair_of(const std::string& secret_key);

/// Whether the text can be a key: 40 characters of Z85 that stand for 32 bytes.
[[nodiscard]] bool is_key(std::string_view text);

/// Options of a socket that binds. Requires admit_only() before: without a list, ZeroMQ would admit every
/// key.
struct Listener {
    KeyPair keys;
};

/// Options of a socket that connects.
struct Dialler {
    KeyPair keys;
    std::string listener_public_key;
};

/// monostate: no keys, everything in the clear.
using Security = std::variant<std::monostate, Listener, Dialler>;

/// From here on, handshakes with listeners of this context succeed for these public keys and no others. A
/// second call replaces the list: a RouterSocket hears nobody any more who is not on it, a PublisherSocket shows such
/// subscribers out when it is asked to. Refuses what is no key.
[[nodiscard]] Result<void> admit_only(const Context& context, const std::vector<std::string>& public_keys);

struct RefusedKey {
    std::string public_key;
    std::string address;  ///< Of the machine, as a number.
};

/// Who knocked with a key that is not listed, since the last call; at most 1,000.
[[nodiscard]] std::vector<RefusedKey> take_refused_keys(const Context& context);

/// Whether a listening endpoint can be reached from other machines: true for all but inproc, ipc and the
/// loopback addresses of TCP (127.0.0.0/8, ::1, localhost).
[[nodiscard]] bool reaches_other_machines(std::string_view endpoint);

}  // namespace pathscope
