// docs/protocol.md and the code cannot drift: the document's tables are read and compared with the code's.

#include <map>
#include <sstream>

#include "pathscope/core/files.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/protocol/table.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

using Row = std::vector<std::string>;

std::string trimmed(std::string_view text) {
    const auto first = text.find_first_not_of(" `");
    if (first == std::string_view::npos) return {};
    return std::string(text.substr(first, text.find_last_not_of(" `") - first + 1));
}

Row split_row(std::string_view line) {
    Row cells;
    line.remove_prefix(1);
    while (!line.empty()) {
        const std::size_t bar = line.find('|');
        if (bar == std::string_view::npos) break;
        cells.push_back(trimmed(line.substr(0, bar)));
        line.remove_prefix(bar + 1);
    }
    return cells;
}

/// The tables under each heading, without their two head lines.
struct Document {
    std::map<std::string, std::vector<Row>> tables;
    std::string hex;  ///< What stands in the block ```hex.
    std::string text;
};

Document read_document() {
    const auto text = read_file("docs/protocol.md");
    REQUIRE_MESSAGE(bool(text), "run the tests from the project's folder");
    Document document;
    document.text = *text;
    std::istringstream lines(*text);
    std::string line, heading;
    int row = 0;
    bool in_hex = false;
    while (std::getline(lines, line)) {
        if (line.starts_with("```"))
            in_hex = line == "```hex";
        else if (in_hex)
            document.hex += line + "\n";
        if (line.starts_with("#")) heading = trimmed(line.substr(line.find_first_not_of('#')));
        row = line.starts_with("|") ? row + 1 : 0;
        if (row > 2) document.tables[heading].push_back(split_row(line));
    }
    return document;
}

std::string size_text(std::size_t bytes) {
    if (bytes == 0) return "";
    if (bytes % (1 << 20) == 0) return std::to_string(bytes >> 20) + " MiB";
    return std::to_string(bytes >> 10) + " KiB";
}

std::string hex_type(MessageType type) {
    static constexpr char k_digits[] = "0123456789ABCDEF";
    const auto byte = static_cast<std::uint8_t>(type);
    return {'0', 'x', k_digits[byte >> 4], k_digits[byte & 15]};
}

std::string to_hex_text(const std::string& bytes) {
    static constexpr char k_digits[] = "0123456789abcdef";
    std::string text;
    for (const char c : bytes) {
        if (!text.empty()) text += ' ';
        text += k_digits[static_cast<unsigned char>(c) >> 4];
        text += k_digits[static_cast<unsigned char>(c) & 15];
    }
    return text;
}

}  // namespace

TEST_CASE("the document lists the messages of the code: type, name, direction, channel, payload, limit") {
    const Document document = read_document();
    const std::vector<Row>& rows = document.tables.at("3 Messages");
    REQUIRE(rows.size() == k_message_table.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const MessageInfo& info = k_message_table[i];
        const Row expected{hex_type(info.type),
                           std::string(info.name),
                           std::string(name_of(info.direction)),
                           std::string(name_of(info.channel)),
                           std::string(info.payload),
                           size_text(info.max_payload_bytes)};
        CHECK(rows[i] == expected);
    }
}

TEST_CASE("the document lists the fields of each message, with types and limits, in the code's order") {
    Document document = read_document();
    for (const MessageInfo& info : k_message_table) {
        CAPTURE(info.name);
        const std::vector<Row>& rows = document.tables[std::string(info.name)];
        const std::vector<FieldInfo> fields = message_fields(info.type);
        REQUIRE(rows.size() == fields.size());
        for (std::size_t i = 0; i < rows.size(); ++i) {
            REQUIRE(rows[i].size() == 4);
            CHECK(rows[i][0] == fields[i].name);
            CHECK(rows[i][1] == fields[i].type);
            CHECK(rows[i][2] == fields[i].limits);
        }
    }
}

TEST_CASE("the document's faults are those that decode tells apart, in its order") {
    const Document document = read_document();
    const std::vector<Row>& rows = document.tables.at("8 What is dropped, and counted");
    REQUIRE(rows.size() > k_decode_fault_names.size());
    for (std::size_t i = 0; i < k_decode_fault_names.size(); ++i)
        CHECK(rows[i][0] == k_decode_fault_names[i].name);
}

TEST_CASE("S6: the document's bytes are what the code sends") {
    const Frames frames = encode(message::Credit{77, 4, LeaseId{3}});
    CHECK(read_document().hex == to_hex_text(frames[0]) + "\n" + to_hex_text(frames[1]) + "\n");
}

TEST_CASE("the document is of the code's version, and names the channels and codecs") {
    const Document document = read_document();
    CHECK(document.text.starts_with("# The Pathscope protocol, version " +
                                    std::to_string(k_protocol_version) + "\n"));
    const std::vector<Row>& sockets = document.tables.at("1 Sockets");
    REQUIRE(sockets.size() == k_channel_names.size());
    for (std::size_t i = 0; i < sockets.size(); ++i) CHECK(sockets[i][0] == k_channel_names[i].name);
}
