#include "pathscope/protocol/table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fields.hpp"
#include "pathscope/protocol/codec.hpp"

namespace pathscope {
namespace {

/// Visitor that lists fields as docs/protocol.md shows them.
class FieldLister {
  public:
    void u32(std::string_view name, std::uint32_t, std::uint32_t least, std::uint32_t most) {
        add(name, "u32", range(least, most, k_max_u32));
    }
    void u64(std::string_view name, std::uint64_t, std::uint64_t least, std::uint64_t most) {
        add(name, "u64", range(least, most, k_max_u64));
    }
    void optional_u32(std::string_view name, std::uint32_t, std::uint32_t least, std::uint32_t most,
                      std::uint32_t absent) {
        add(name, "u32", fmt::format("{}; absent: {}", range(least, most, k_max_u32), absent));
    }
    void time(std::string_view name, TimeNs) { add(name, "time", "any"); }
    void text(std::string_view name, const std::string&, std::size_t least, std::size_t most) {
        add(name, "str", fmt::format("{} to {} bytes", least, most));
    }
    void free_text(std::string_view name, const std::string& value, std::size_t most) {
        text(name, value, 0, most);
    }
    void bytes(std::string_view name, const std::string&, std::size_t size) {
        add(name, "bin", fmt::format("{} bytes", size));
    }
    void hash(std::string_view name, const Digest& value) {
        add(name, "bin", fmt::format("{} bytes", value.size()));
    }
    template <class E>
    void word(std::string_view name, E) {
        add(name, "name", joined_names<E>(", "));
    }
    void rect(std::string_view name, const PixelRect&) { add(name, "rect", "inside 65536 x 65536"); }
    void numbers(std::string_view name, const std::vector<std::uint64_t>&, std::size_t most) {
        add(name, "u64[]", fmt::format("0 to {} items", most));
    }
    void samples(std::string_view name, const std::vector<DroppedSample>&, std::size_t most) {
        add(name, "sample[]", fmt::format("0 to {} items", most));
    }
    void payload(const std::string&) {}

    std::vector<FieldInfo> fields;

  private:
    void add(std::string_view name, std::string type, std::string limits) {
        fields.push_back({std::string(name), std::move(type), std::move(limits)});
    }
    static std::string range(std::uint64_t least, std::uint64_t most, std::uint64_t most_of_type) {
        if (least == 0 && most == most_of_type) return "any";
        return fmt::format("{} to {}", least, most);
    }
};

template <std::size_t... Index>
std::vector<FieldInfo> list_fields(std::size_t index, std::index_sequence<Index...>) {
    FieldLister lister;
    const auto list = [&]<class M>(M message) { describe(lister, message); };
    (void)((Index == index && (list(std::variant_alternative_t<Index, Message>{}), true)) || ...);
    return lister.fields;
}

}  // namespace

const MessageInfo* find_message(std::uint8_t type) {
    const auto found = std::ranges::find_if(k_message_table, [type](const MessageInfo& info) {
        return static_cast<std::uint8_t>(info.type) == type;
    });
    return found == k_message_table.end() ? nullptr : &*found;
}

std::string_view name_of(MessageType type) {
    const MessageInfo* info = find_message(static_cast<std::uint8_t>(type));
    return info ? info->name : "?";
}

std::size_t max_frame_bytes(Channel channel) {
    std::size_t most = k_max_header_bytes;
    for (const MessageInfo& info : k_message_table)
        if (info.channel == channel) most = std::max(most, info.max_payload_bytes + k_max_header_bytes);
    return most;
}

std::vector<FieldInfo> message_fields(MessageType type) {
    const MessageInfo* info = find_message(static_cast<std::uint8_t>(type));
    CHECK(info != nullptr, int(type));
    const auto index = static_cast<std::size_t>(info - k_message_table.data());
    return list_fields(index, std::make_index_sequence<std::variant_size_v<Message>>{});
}

MessageType type_of(const Message& message) { return k_message_table[message.index()].type; }

}  // namespace pathscope
