#pragma once
/// Content hashes: BLAKE2b with 32 bytes (libsodium's crypto_generichash).
///
/// Scene files travel and are cached by these; image_hash in the statistics is one of the float pixels.
/// Source: Aumasson et al. 2013, "BLAKE2: simpler, smaller, fast as MD5" (RFC 7693).
/// Thread safety: yes; a Hasher belongs to one thread.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace pathscope {

using Digest = std::array<std::uint8_t, 32>;

[[nodiscard]] Digest hash_bytes(std::span<const std::byte> bytes);
[[nodiscard]] Digest hash_text(std::string_view text);

[[nodiscard]] std::string to_hex(const Digest& digest);  ///< 64 lower-case digits.
[[nodiscard]] std::optional<Digest> digest_from_hex(
    std::string_view text);  ///< Nothing unless 64 hex digits.

/// Hash of a text that arrives in parts; the same as hash_text of all parts joined.
class Hasher {
  public:
    Hasher();
    Hasher(const Hasher&) = delete;
    Hasher& operator=(const Hasher&) = delete;

    void add(std::span<const std::byte> bytes);
    void add(std::string_view text);
    [[nodiscard]] Digest finish();  ///< Once.

  private:
    /// libsodium's, in place: a message of a few hundred bytes would else cost more to allocate for than to hash.
    struct alignas(64) State {
        std::array<std::byte, 384> bytes;
    };
    State state_;
    bool finished_ = false;
};

}  // namespace pathscope
