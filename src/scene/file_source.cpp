#include "pathscope/scene/file_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "pathscope/core/files.hpp"

namespace pathscope {
namespace {

namespace fs = std::filesystem;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_but_for_case(std::string_view a, std::string_view b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](char x, char y) { return lower(x) == lower(y); });
}

bool has_drive(std::string_view name) {
    return name.size() >= 3 && lower(name[0]) >= 'a' && lower(name[0]) <= 'z' && name[1] == ':' &&
           name[2] == '/';
}

bool is_absolute(std::string_view name) { return name.starts_with('/') || has_drive(name); }

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view k_space = " \t\r\n";
    const std::size_t first = text.find_first_not_of(k_space);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(k_space) - first + 1);
}

std::vector<std::string_view> parts_of(std::string_view name) {
    std::vector<std::string_view> parts;
    while (!name.empty()) {
        const std::size_t slash = std::min(name.find('/'), name.size());
        if (slash > 0) parts.push_back(name.substr(0, slash));
        name.remove_prefix(std::min(slash + 1, name.size()));
    }
    return parts;
}

/// The entry of a folder with this name, or else with this name in other letters. Among several of those the
/// first in byte order, so that the choice does not depend on the order of the folder.
std::optional<fs::path> entry_of(const fs::path& folder, std::string_view part) {
    std::error_code error;
    if (fs::exists(folder / part, error)) return folder / part;
    std::optional<fs::path> best;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
        const fs::path candidate = entry->path();
        if (same_but_for_case(candidate.filename().string(), part) && (!best || candidate < *best))
            best = candidate;
    }
    return best;
}

/// Only a regular file counts: opening a pipe or a device could wait or read without end.
std::optional<fs::path> file_at(fs::path folder, std::string_view name) {
    for (const std::string_view part : parts_of(name)) {
        const std::optional<fs::path> next = part == ".." ? folder / part : entry_of(folder, part);
        if (!next) return std::nullopt;
        folder = *next;
    }
    std::error_code error;
    if (!fs::is_regular_file(folder, error)) return std::nullopt;
    return folder;
}

std::optional<fs::path> locate(const fs::path& root, std::string_view name) {
    if (!is_absolute(name)) return file_at(root, name);
    if (name.starts_with('/'))
        if (auto path = file_at("/", name)) return path;
    const auto parts = parts_of(name);
    return parts.empty() ? std::nullopt : file_at(root, parts.back());
}

}  // namespace

Result<std::string> FileSource::read(std::string_view name) {
    Result<std::optional<std::string>> bytes = find(name);
    if (!bytes) return bytes.error();
    if (!*bytes) return bad_input(fmt::format("{}: there is no such file.", display_name(name)));
    return std::move(**bytes);
}

std::string scene_name(std::string_view referrer, std::string_view name) {
    name = trimmed(name);
    if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
    std::string joined(name);
    std::replace(joined.begin(), joined.end(), '\\', '/');
    if (!is_absolute(joined)) joined.insert(0, referrer.substr(0, referrer.rfind('/') + 1));

    std::vector<std::string_view> kept;
    for (const std::string_view part : parts_of(joined)) {
        if (part == ".") continue;
        if (part == ".." && !kept.empty() && kept.back() != "..")
            kept.pop_back();
        else
            kept.push_back(part);
    }
    std::string result = joined.starts_with('/') ? "/" : "";
    for (std::size_t i = 0; i < kept.size(); ++i) {
        if (i > 0) result += '/';
        result += kept[i];
    }
    return result;
}

DiskFiles::DiskFiles(std::filesystem::path root) : root_(std::move(root)) {
    if (root_.empty()) root_ = ".";
}

Result<std::optional<std::string>> DiskFiles::find(std::string_view name) {
    const std::optional<fs::path> path = locate(root_, name);
    if (!path) {
        missing_.emplace(name);
        return std::optional<std::string>{};
    }
    Result<std::string> bytes = read_file(*path);
    if (!bytes) return bytes.error();
    found_.insert_or_assign(std::string(name), Found{*path, bytes->size(), hash_text(*bytes)});
    return std::optional(std::move(*bytes));
}

std::string DiskFiles::display_name(std::string_view name) const {
    if (const auto found = found_.find(name); found != found_.end())
        return found->second.path.lexically_normal().string();
    return is_absolute(name) ? std::string(name) : (root_ / name).lexically_normal().string();
}

std::optional<Digest> DiskFiles::known_hash(std::string_view name) const {
    const auto found = found_.find(name);
    if (found == found_.end()) return std::nullopt;
    return found->second.hash;
}

Manifest DiskFiles::manifest() const {
    Manifest manifest;
    for (const auto& [name, found] : found_) manifest.files.push_back({name, found.size, found.hash});
    manifest.missing.assign(missing_.begin(), missing_.end());
    return manifest;
}

std::optional<std::filesystem::path> DiskFiles::path_of(std::string_view name) const {
    const auto found = found_.find(name);
    if (found == found_.end()) return std::nullopt;
    return found->second.path;
}

ManifestFiles::ManifestFiles(const Manifest& manifest, PathOfHash path_of_hash)
    : missing_(manifest.missing.begin(), manifest.missing.end()), path_of_hash_(std::move(path_of_hash)) {
    for (const ManifestEntry& entry : manifest.files) files_.emplace(entry.name, entry);
}

Result<std::optional<std::string>> ManifestFiles::find(std::string_view name) {
    if (missing_.contains(name)) return std::optional<std::string>{};
    const auto entry = files_.find(name);
    if (entry == files_.end())
        return failed(fmt::format(
            "{}: the client did not list this file; its manifest is of another scene or other options.",
            name));

    Result<std::string> bytes = read_file(path_of_hash_(entry->second.hash));
    if (!bytes) return failed(fmt::format("{}: not in the cache. {}", name, bytes.error().message));
    if (bytes->size() != entry->second.size || hash_text(*bytes) != entry->second.hash)
        return failed(
            fmt::format("{}: the cached copy differs from what the client listed; fetch it again.", name));
    return std::optional(std::move(*bytes));
}

std::optional<Digest> ManifestFiles::known_hash(std::string_view name) const {
    const auto entry = files_.find(name);
    if (entry == files_.end()) return std::nullopt;
    return entry->second.hash;
}

}  // namespace pathscope
