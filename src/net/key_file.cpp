#include "pathscope/net/key_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <sstream>
#include <system_error>

#include "descriptor.hpp"
#include "pathscope/core/files.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_max_secret_file_bytes = 4096;

std::string reason(int error) { return std::generic_category().message(error); }

std::filesystem::path public_file_of(std::filesystem::path path) { return path += ".pub"; }

/// 0 or an errno. The file is written under a name of its own and then linked to the one that is wanted, which fails
/// if that is taken: so it is there whole or not at all, and nothing is ever overwritten.
int create_file(const std::filesystem::path& path, std::string_view bytes, mode_t mode) {
    std::string part = path.string() + ".partXXXXXX";
    const Descriptor file(::mkostemp(part.data(), O_CLOEXEC));  // Made with mode 0600.
    if (!file) return errno;
    int error = 0;
    if (::write(file.get(), bytes.data(), bytes.size()) != ssize_t(bytes.size()) ||
        ::fchmod(file.get(), mode) != 0 || ::fsync(file.get()) != 0 ||
        ::link(part.c_str(), path.c_str()) != 0)
        error = errno;
    ::unlink(part.c_str());
    return error;
}

Error cannot_write(const std::filesystem::path& path, int error) {
    if (error == EEXIST)
        return bad_input(
            fmt::format("{} exists; a key is never overwritten. Name another file, or remove it if "
                        "nobody needs that key any more.",
                        path.string()));
    return bad_input(fmt::format("Cannot write {}: {}.", path.string(), reason(error)));
}

Result<void> check_private(const std::filesystem::path& path, const struct stat& status) {
    if (!S_ISREG(status.st_mode)) return bad_input(fmt::format("{} is no plain file.", path.string()));
    if (status.st_uid != ::geteuid() && status.st_uid != 0)
        return bad_input(fmt::format("{} belongs to another user, who can read and change this secret key.",
                                     path.string()));
    if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
        return bad_input(
            fmt::format("{} is open to others (mode {:04o}), but holds a secret key. Run: chmod 600 {}",
                        path.string(), status.st_mode & 07777, path.string()));
    return {};
}

}  // namespace

Result<void> write_key_files(const std::filesystem::path& path, const KeyPair& keys) {
    const std::filesystem::path public_path = public_file_of(path);
    std::error_code ignored;
    if (std::filesystem::exists(public_path, ignored)) return cannot_write(public_path, EEXIST);
    const std::string secret_text = fmt::format(
        "# Pathscope: keep this file secret. Its public key, for others, is in {}\npublic {}\nsecret {}\n",
        public_path.filename().string(), keys.public_key, keys.secret_key);
    if (const int error = create_file(path, secret_text, 0600)) return cannot_write(path, error);
    const std::string public_text = fmt::format("{} # {}\n", keys.public_key, path.filename().string());
    if (const int error = create_file(public_path, public_text, 0644)) {
        std::filesystem::remove(path, ignored);
        return cannot_write(public_path, error);
    }
    return {};
}

Result<KeyPair> read_secret_key_file(const std::filesystem::path& path) {
    // What is checked and what is read must be one file: so both by one descriptor.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat status {};
    if (!file || ::fstat(file.get(), &status) != 0)
        return bad_input(fmt::format("Cannot open the key file {}: {}.", path.string(), reason(errno)));
    if (const auto is_private = check_private(path, status); !is_private) return is_private.error();
    std::string text(k_max_secret_file_bytes, '\0');
    const ssize_t size = ::read(file.get(), text.data(), text.size());
    if (size < 0) return bad_input(fmt::format("Cannot read {}: {}.", path.string(), reason(errno)));
    text.resize(std::size_t(size));

    KeyPair told;
    std::istringstream lines(text);
    for (std::string line, word; std::getline(lines, line);) {
        std::istringstream words(line);
        words >> word;
        if (word == "public") words >> told.public_key;
        if (word == "secret") words >> told.secret_key;
    }
    const Result<KeyPair> keys = key_pair_of(told.secret_key);
    if (!keys)
        return bad_input(fmt::format(
            "{} holds no secret key: it lacks a line 'secret KEY', as --keygen writes it.", path.string()));
    if (keys->public_key != told.public_key)
        return bad_input(
            fmt::format("{} is damaged: its public key does not belong to its secret key.", path.string()));
    return *keys;
}

Result<std::string> public_key_of(const std::string& text) {
    if (is_key(text)) return text;
    const Result<std::string> bytes = read_file(text);
    if (!bytes)
        return bad_input(
            fmt::format("'{}' is neither a public key of 40 characters nor a file of one.", text));
    const KeyList list = parse_key_list(*bytes, text);
    if (list.keys.size() != 1 || !list.mistakes.empty())
        return bad_input(fmt::format(
            "{} is no file of one public key, such as --keygen writes beside the secret one.", text));
    return list.keys.front();
}

KeyList parse_key_list(std::string_view text, const std::string& name) {
    KeyList list;
    std::istringstream lines{std::string(text)};
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        std::istringstream words(line);
        std::string first, second;
        words >> first >> second;
        if (is_key(first) && (second.empty() || second.starts_with('#')))
            list.keys.push_back(first);
        else if (!first.empty() && first != "#")
            list.mistakes.push_back(
                fmt::format("{}:{}: this is no public key of 40 characters, with '# NAME' after it or not.",
                            name, number));
    }
    return list;
}

}  // namespace pathscope
