#include "pathscope/core/hash.hpp"

#include <sodium.h>

#include <utility>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// Lets libsodium look which instructions this processor has. It would else take the slowest code, which gives the same.
void prepare() {
    static const bool ready = sodium_init() >= 0;
    CHECK(ready);
}

const unsigned char* bytes_of(std::span<const std::byte> bytes) {
    return reinterpret_cast<const unsigned char*>(bytes.data());
}

template <class State>
crypto_generichash_state* blake(State& state) {
    static_assert(sizeof(State) == sizeof(crypto_generichash_state));
    static_assert(alignof(State) >= alignof(crypto_generichash_state));
    return reinterpret_cast<crypto_generichash_state*>(&state);
}

}  // namespace

Hasher::Hasher() {
    prepare();
    CHECK(crypto_generichash_init(blake(state_), nullptr, 0, Digest{}.size()) == 0);
}

void Hasher::add(std::span<const std::byte> bytes) {
    CHECK(!finished_);
    crypto_generichash_update(blake(state_), bytes_of(bytes), bytes.size());
}

void Hasher::add(std::string_view text) { add(std::as_bytes(std::span(text))); }

Digest Hasher::finish() {
    CHECK(!std::exchange(finished_, true));
    Digest digest;
    crypto_generichash_final(blake(state_), digest.data(), digest.size());
    return digest;
}

Digest hash_bytes(std::span<const std::byte> bytes) {
    prepare();
    Digest digest;
    CHECK(crypto_generichash(digest.data(), digest.size(), bytes_of(bytes), bytes.size(), nullptr, 0) == 0);
    return digest;
}

Digest hash_text(std::string_view text) { return hash_bytes(std::as_bytes(std::span(text))); }

std::string to_hex(const Digest& digest) {
    static constexpr char k_digits[] = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : digest) {
        text += k_digits[byte >> 4];
        text += k_digits[byte & 15];
    }
    return text;
}

std::optional<Digest> digest_from_hex(std::string_view text) {
    Digest digest;
    if (text.size() != 2 * digest.size()) return std::nullopt;
    std::size_t written = 0;
    const char* end = nullptr;
    sodium_hex2bin(digest.data(), digest.size(), text.data(), text.size(), nullptr, &written, &end);
    if (written != digest.size() || end != text.data() + text.size()) return std::nullopt;
    return digest;
}

}  // namespace pathscope
