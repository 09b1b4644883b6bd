#pragma once
/// Files of keys: a secret one for its owner, a public one to hand out, a list of those who may come in.
///
///     secret file F               public file F.pub, allow-list
///     # Pathscope: keep secret    # a line that begins with # and a space is a comment
///     public KEY                  KEY # whose it is
///     secret KEY                  KEY # another one
///
/// A public file is an allow-list of one line, so that `cat F.pub >> list` admits its owner. KEY is 40 characters (Z85), of
/// which some mean something to a shell: quote it, or name the file.
/// Ensures: a secret file is made with mode 0600, whole or not at all, and never over another file; one that others
/// can read or change is refused.   Thread safety: yes.   Test: tests/net/test_key_file.cpp

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/net/security.hpp"

namespace pathscope {

/// Writes `path` and `path`.pub. Refuses if either exists.
[[nodiscard]] Result<void> write_key_files(const std::filesystem::path& path, const KeyPair& keys);

/// Refuses a file that others than its owner can read or write, that is another user's, or whose two keys do not
/// belong together.
[[nodiscard]] Result<KeyPair> read_secret_key_file(const std::filesystem::path& path);

/// `text` if it is a key, else the only key of the file of that name.
[[nodiscard]] Result<std::string> public_key_of(const std::string& text);

/// An allow-list as it was read.
struct KeyList {
    std::vector<std::string> keys;
    std::vector<std::string> mistakes;  ///< A sentence for each line that is neither a key nor a comment.
};

/// `name` is for the sentences.
[[nodiscard]] KeyList parse_key_list(std::string_view text, const std::string& name);

}  // namespace pathscope
