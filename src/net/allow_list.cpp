#include "pathscope/net/allow_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/net/key_file.hpp"

namespace pathscope {
namespace {

/// In an order of their own, each once: so that lists can be compared.
std::vector<std::string> in_order(std::vector<std::string> keys) {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return keys;
}

}  // namespace

Result<AllowList> AllowList::open(const std::filesystem::path& path) {
    Result<std::string> text = read_file(path);
    if (!text) return text.error();
    KeyList list = parse_key_list(*text, path.string());
    if (!list.mistakes.empty()) return bad_input(list.mistakes.front());
    AllowList allowed;
    allowed.path_ = path;
    allowed.keys_ = in_order(std::move(list.keys));
    allowed.text_ = allowed.last_read_ = std::move(*text);
    return allowed;
}

bool AllowList::changed(TimeNs now) {
    if (now < next_look_) return false;
    next_look_ = now + k_look;
    const Result<std::string> read = read_file(path_);
    const std::string text = read ? *read : std::string();
    if (std::exchange(last_read_, text) != text || text == text_) return false;

    if (!read) log_warning(fmt::format("{} Nobody is listed until it can be read.", read.error().message));
    KeyList list = parse_key_list(text, path_.string());
    for (const std::string& mistake : list.mistakes) log_warning(mistake);
    text_ = text;
    const std::vector<std::string> before = std::exchange(keys_, in_order(std::move(list.keys)));
    return keys_ != before;
}

}  // namespace pathscope
