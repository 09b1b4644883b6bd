#include "pathscope/core/files.hpp"

#include <fmt/format.h>
#include <unistd.h>

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
    static std::atomic<unsigned> writes{0};  // Two threads may write the same file: each has its own part.
    std::filesystem::path part = path;
    part += fmt::format(".part{}-{}", ::getpid(), writes.fetch_add(1));
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
    return {};
}

}  // namespace pathscope
