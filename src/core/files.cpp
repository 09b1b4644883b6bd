#include "pathscope/core/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

namespace pathscope {
namespace {

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using FileHandle = std::unique_ptr<std::FILE, CloseFile>;

std::string reason() { return std::generic_category().message(errno); }

constexpr std::string_view k_part = ".part";

std::filesystem::path folder_of(const std::filesystem::path& path) {
    return path.has_parent_path() ? path.parent_path() : ".";
}

/// Makes the new name last. Some file systems cannot, and some folders may be written and not read; the file is whole
/// all the same, so that this is no error.
void sync_folder(const std::filesystem::path& folder) {
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    ::fsync(descriptor);
    ::close(descriptor);
}

/// Where a file is written before it gets its name. Two threads may write the same file: each has its own part.
std::filesystem::path part_of(std::filesystem::path path) {
    static std::atomic<unsigned> parts{0};
    path += fmt::format("{}{}-{}", k_part, ::getpid(), parts.fetch_add(1));
    return path;
}

/// "<process>-<number>"
bool is_part_number(std::string_view text) {
    const std::size_t dash = text.find('-');
    const auto is_number = [](std::string_view digits) {
        return !digits.empty() && std::all_of(digits.begin(), digits.end(),
                                              [](char digit) { return digit >= '0' && digit <= '9'; });
    };
    return dash != std::string_view::npos && is_number(text.substr(0, dash)) &&
           is_number(text.substr(dash + 1));
}

}  // namespace

Result<std::string> read_file(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        return bad_input(fmt::format("{} is a folder; name a file.", path.string()));
    const FileHandle file(std::fopen(path.c_str(), "rb"));
    if (!file) return bad_input(fmt::format("Cannot open {}: {}.", path.string(), reason()));

    std::string bytes;
    if (const std::uintmax_t size = std::filesystem::file_size(path, ignored); !ignored)
        bytes.reserve(std::size_t(size));
    char buffer[1 << 16];
    while (const std::size_t got = std::fread(buffer, 1, sizeof buffer, file.get()))
        bytes.append(buffer, got);
    if (std::ferror(file.get()))
        return bad_input(fmt::format("Cannot read {}: {}.", path.string(), reason()));
    return bytes;
}

Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes) {
    const std::filesystem::path part = part_of(path);
    const auto give_up = [&]() -> Result<void> {
        const std::string why = reason();
        std::error_code ignored;
        std::filesystem::remove(part, ignored);
        return bad_input(fmt::format("Cannot write {}: {}.", path.string(), why));
    };

    FileHandle file(std::fopen(part.c_str(), "wb"));
    if (!file) return give_up();
    if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) return give_up();
    if (std::fflush(file.get()) != 0 || ::fsync(::fileno(file.get())) != 0) return give_up();
    file.reset();
    if (std::rename(part.c_str(), path.c_str()) != 0) return give_up();
    sync_folder(folder_of(path));
    return {};
}

void remove_abandoned_parts(const std::filesystem::path& path) {
    const std::string prefix = path.filename().string() + std::string(k_part);
    std::error_code end, ignored;
    for (std::filesystem::directory_iterator entry(folder_of(path), end), last; !end && entry != last;
         entry.increment(end)) {
        const std::string name = entry->path().filename().string();
        if (name.starts_with(prefix) && is_part_number(std::string_view(name).substr(prefix.size())))
            std::filesystem::remove(entry->path(), ignored);
    }
}

Result<void> check_place(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        return bad_input(fmt::format("{} is a folder; name a file.", path.string()));
    const std::filesystem::path part = part_of(path);
    if (const FileHandle file(std::fopen(part.c_str(), "wb")); !file) {
        const std::string why = reason();
        const std::filesystem::path folder = folder_of(path);
        if (!std::filesystem::is_directory(folder, ignored))
            return bad_input(fmt::format("Cannot write {}: there is no folder {}; make it first.",
                                         path.string(), folder.string()));
        return bad_input(fmt::format("Cannot write {}: {}.", path.string(), why));
    }
    std::filesystem::remove(part, ignored);
    return {};
}

}  // namespace pathscope
