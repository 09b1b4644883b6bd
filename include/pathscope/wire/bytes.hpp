#pragma once
/// Numbers to bytes and back, each read checked against the end of the buffer.
///
///     ByteWriter out;                      ByteReader in(out.bytes());
///     out.little(std::uint32_t{7});        in.little<std::uint32_t>() == 7
///
/// Why: a length that arrives over the wire is a claim. A reader that cannot step past its end makes the
/// claim harmless: a miss is an empty optional, and the reader stays where it was.
/// Convention: payloads are little-endian, MessagePack is big-endian. Floats go as their IEEE 754 bits.
/// Thread safety: as std::string.   Test: tests/wire/test_bytes.cpp

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

namespace pathscope {

template <class T>
concept WireNumber = std::is_arithmetic_v<T> && !std::same_as<T, bool>;

namespace detail {
template <std::size_t Size>
using UnsignedOfSize =
    std::conditional_t<Size == 1, std::uint8_t,
                       std::conditional_t<Size == 2, std::uint16_t,
                                          std::conditional_t<Size == 4, std::uint32_t, std::uint64_t>>>;
}

class ByteWriter {
  public:
    template <WireNumber T>
    void little(T value) {
        number(value, [](std::size_t i) { return 8 * i; });
    }

    template <WireNumber T>
    void big(T value) {
        number(value, [](std::size_t i) { return 8 * (sizeof(T) - 1 - i); });
    }

    void raw(std::string_view bytes) { bytes_.append(bytes); }
    void reserve(std::size_t bytes) { bytes_.reserve(bytes); }  ///< Room for so many in all.

    [[nodiscard]] const std::string& bytes() const { return bytes_; }
    [[nodiscard]] std::string take() { return std::move(bytes_); }

  private:
    template <class T, class ShiftOfByte>
    void number(T value, ShiftOfByte shift_of_byte) {
        const auto bits = std::bit_cast<detail::UnsignedOfSize<sizeof(T)>>(value);
        char bytes[sizeof(T)];
        for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = static_cast<char>(bits >> shift_of_byte(i));
        bytes_.append(bytes, sizeof bytes);
    }

    std::string bytes_;
};

/// Requires: the bytes outlive the reader and what raw() returned.
class ByteReader {
  public:
    explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

    template <WireNumber T>
    [[nodiscard]] std::optional<T> little() {
        return number<T>([](std::size_t i) { return 8 * i; });
    }

    template <WireNumber T>
    [[nodiscard]] std::optional<T> big() {
        return number<T>([](std::size_t i) { return 8 * (sizeof(T) - 1 - i); });
    }

    [[nodiscard]] std::optional<std::string_view> raw(std::size_t size) {
        if (size > rest_.size()) return std::nullopt;
        const std::string_view taken = rest_.substr(0, size);
        rest_.remove_prefix(size);
        return taken;
    }

    [[nodiscard]] std::size_t remaining() const { return rest_.size(); }

  private:
    template <class T, class ShiftOfByte>
    std::optional<T> number(ShiftOfByte shift_of_byte) {
        using Bits = detail::UnsignedOfSize<sizeof(T)>;
        const auto taken = raw(sizeof(T));
        if (!taken) return std::nullopt;
        Bits bits = 0;
        for (std::size_t i = 0; i < sizeof(T); ++i)
            bits = static_cast<Bits>(bits | Bits{static_cast<std::uint8_t>((*taken)[i])} << shift_of_byte(i));
        return std::bit_cast<T>(bits);
    }

    std::string_view rest_;
};

}  // namespace pathscope
