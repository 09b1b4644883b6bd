#include <fmt/format.h>

#include <iterator>

#include "fields.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/wire/utf8.hpp"

namespace pathscope {
namespace {

/// Visitor that prints "name=value" for each field.
class LineWriter {
  public:
    void u32(std::string_view name, std::uint32_t value, std::uint32_t, std::uint32_t) { put(name, value); }
    void u64(std::string_view name, std::uint64_t value, std::uint64_t, std::uint64_t) { put(name, value); }
    void optional_u32(std::string_view name, std::uint32_t value, std::uint32_t, std::uint32_t,
                      std::uint32_t absent) {
        if (value != absent) put(name, value);
    }
    void time(std::string_view name, TimeNs value) { put(name, value); }
    void text(std::string_view name, const std::string& value, std::size_t, std::size_t most) {
        free_text(name, value, most);
    }
    void free_text(std::string_view name, const std::string& value, std::size_t most) {
        const std::string shown = make_printable(value, most);
        if (shown.find(' ') == std::string::npos && !shown.empty()) return put(name, shown);
        put(name, '"' + shown + '"');
    }
    void bytes(std::string_view name, const std::string& value, std::size_t) { put(name, hex(value)); }
    void hash(std::string_view name, const Digest& value) { put(name, to_hex(value).substr(0, 8)); }
    template <class E>
    void word(std::string_view name, E value) {
        put(name, name_of(value));
    }
    void rect(std::string_view name, const PixelRect& r) {
        put(name, fmt::format("{}x{}+{}+{}", r.width, r.height, r.x, r.y));
    }
    void numbers(std::string_view name, const std::vector<std::uint64_t>& values, std::size_t) {
        put(name, fmt::format("[{}]", values.size()));
    }
    void samples(std::string_view name, const std::vector<DroppedSample>& values, std::size_t) {
        put(name, fmt::format("[{}]", values.size()));
    }
    void payload(const std::string& bytes) { put("payload", fmt::format("{}B", bytes.size())); }

    std::string line;

  private:
    template <class T>
    void put(std::string_view name, const T& value) {
        fmt::format_to(std::back_inserter(line), " {}={}", name, value);
    }
    static std::string hex(std::string_view bytes) {
        std::string digits;
        for (const char byte : bytes.substr(0, 4))
            fmt::format_to(std::back_inserter(digits), "{:02x}", static_cast<unsigned char>(byte));
        return digits;
    }
};

}  // namespace

std::string to_text(const Message& message) {
    LineWriter writer;
    std::visit([&](const auto& m) { describe(writer, m); }, message);
    return std::string(name_of(type_of(message))) + writer.line;
}

}  // namespace pathscope
