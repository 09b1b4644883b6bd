#pragma once
/// A short text that lives inside its event: at most N bytes, no allocation.
///
/// Why: what peers send ends up in events, and the event store's memory must stay bounded whatever they send.
/// A longer text is cut in front of the first character (UTF-8) that does not fit. Thread safety: value.
/// Test: tests/probe/test_event_store.cpp

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace pathscope {

template <std::size_t N>
class BoundedText {
  public:
    static_assert(N <= 255, "the length is one byte");

    BoundedText() = default;
    BoundedText(std::string_view text) {
        std::size_t length = text.size();
        if (length > N) {
            length = N;
            while (length > 0 && continues_character(text[length])) --length;
        }
        text.copy(bytes_.data(), length);
        length_ = static_cast<std::uint8_t>(length);
    }
    BoundedText(const char* text) : BoundedText(std::string_view(text)) {}

    [[nodiscard]] std::string_view view() const { return {bytes_.data(), length_}; }
    [[nodiscard]] bool empty() const { return length_ == 0; }
    friend bool operator==(const BoundedText& a, const BoundedText& b) { return a.view() == b.view(); }

  private:
    /// True for the second and later bytes of a character: 10xxxxxx.
    static bool continues_character(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) == 0x80; }

    std::array<char, N> bytes_{};
    std::uint8_t length_ = 0;
};

}  // namespace pathscope
