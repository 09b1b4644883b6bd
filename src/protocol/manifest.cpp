#include "pathscope/protocol/manifest.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "fields.hpp"
#include "pathscope/wire/field_reader.hpp"
#include "pathscope/wire/message_pack.hpp"
#include "pathscope/wire/utf8.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_max_name_bytes = 512;

std::string quoted(std::string_view name) { return '\'' + make_printable(name, k_max_name_bytes) + '\''; }

/// The first name that cannot be, as a sentence; empty if all can.
std::string wrong_name(const std::vector<ManifestEntry>& sorted) {
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        if (!is_plain_relative_path(sorted[i].name))
            return fmt::format("MANIFEST: {} is no plain path inside the scene's folder.",
                               quoted(sorted[i].name));
        if (i > 0 && sorted[i - 1].name >= sorted[i].name)
            return fmt::format("MANIFEST: {} is listed twice or out of order.", quoted(sorted[i].name));
    }
    return {};
}

Result<ManifestEntry> read_entry(const PackValue& item) {
    const auto* map = item.get<PackMap>();
    if (!map) return bad_input(fmt::format("MANIFEST: an entry is {}, not a map.", item.kind()));
    FieldReader fields(*map, "MANIFEST");
    ManifestEntry entry;
    entry.name = fields.text("name", 1, k_max_name_bytes);
    entry.size = fields.u64("size", 0, k_max_file_bytes);
    const std::string hash = fields.bytes("hash", entry.hash.size(), entry.hash.size());
    static constexpr std::array<std::string_view, 3> k_keys{"name", "size", "hash"};
    fields.only(k_keys);
    if (fields.error()) return *fields.error();
    std::copy(hash.begin(), hash.end(), entry.hash.begin());
    return entry;
}

}  // namespace

bool is_plain_relative_path(std::string_view name) {
    if (name.empty() || name.size() > k_max_name_bytes || !is_printable_utf8(name)) return false;
    if (name.find_first_of("\\:") != std::string_view::npos) return false;
    for (;;) {
        const std::size_t slash = name.find('/');
        const std::string_view part = name.substr(0, slash);
        if (part.empty() || part == "." || part == "..") return false;
        if (slash == std::string_view::npos) return true;
        name.remove_prefix(slash + 1);
    }
}

Result<std::string> pack_manifest(std::vector<ManifestEntry> files) {
    if (files.size() > k_max_manifest_files)
        return bad_input(fmt::format("The scene has {} files, more than the {} that can travel.",
                                     files.size(), k_max_manifest_files));
    std::ranges::sort(files, {}, &ManifestEntry::name);
    std::string wrong = wrong_name(files);
    if (!wrong.empty()) return bad_input(std::move(wrong));

    PackArray items;
    for (const ManifestEntry& file : files) {
        PackMap map;
        map.set("name", file.name);
        map.set("size", file.size);
        map.set("hash", PackBytes{std::string(file.hash.begin(), file.hash.end())});
        items.push_back(std::move(map));
    }
    std::string bytes = pack(PackValue(std::move(items)));
    if (bytes.size() > k_max_state_bytes)
        return bad_input(
            fmt::format("The list of the scene's files has {} bytes, more than the {} that can travel.",
                        bytes.size(), k_max_state_bytes));
    return bytes;
}

Result<std::vector<ManifestEntry>> unpack_manifest(std::string_view bytes) {
    const auto value = unpack(bytes, k_payload_limits);
    if (!value) return bad_input("MANIFEST: " + value.error().message);
    const auto* items = value->get<PackArray>();
    if (!items) return bad_input(fmt::format("MANIFEST: the payload is {}, not an array.", value->kind()));
    if (items->size() > k_max_manifest_files)
        return bad_input(
            fmt::format("MANIFEST: lists {} files, more than {}.", items->size(), k_max_manifest_files));

    std::vector<ManifestEntry> files;
    for (const PackValue& item : *items) {
        auto entry = read_entry(item);
        if (!entry) return entry.error();
        files.push_back(std::move(*entry));
    }
    std::string wrong = wrong_name(files);
    if (!wrong.empty()) return bad_input(std::move(wrong));
    return files;
}

}  // namespace pathscope
