#include "pathscope/core/hash.hpp"

#include <sodium.h>

#include "pathscope/core/check.hpp"

namespace pathscope {

struct Hasher::State {
    crypto_generichash_state blake;
};

Hasher::Hasher() : state_(std::make_unique<State>()) {
    CHECK(crypto_generichash_init(&state_->blake, nullptr, 0, Digest{}.size()) == 0);
}

Hasher::~Hasher() = default;

void Hasher::add(std::span<const std::byte> bytes) {
    CHECK(state_ != nullptr);
    crypto_generichash_update(&state_->blake, reinterpret_cast<const unsigned char*>(bytes.data()),
                              bytes.size());
}

void Hasher::add(std::string_view text) { add(std::as_bytes(std::span(text))); }

Digest Hasher::finish() {
    CHECK(state_ != nullptr);
    Digest digest;
    crypto_generichash_final(&state_->blake, digest.data(), digest.size());
    state_.reset();
    return digest;
}

Digest hash_bytes(std::span<const std::byte> bytes) {
    Hasher hasher;
    hasher.add(bytes);
    return hasher.finish();
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
