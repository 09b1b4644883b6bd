#pragma once
/// The file of public keys that may come in, read again while the program runs: a key that is taken out is revoked, one
/// that is added is admitted.
///
///     auto list = AllowList::open("servers.allow");       at the start: a mistake is an error
///     if (list->changed(now)) admit_only(context, list->keys());
///
/// What the file says is what holds. Looked at every k_look; a new text counts when two looks in a row have read it, so that
/// an editor that empties a file before it writes it does no harm: a change holds within 2 k_look and what
/// passes between calls. In a running program a line that is no key is passed over with a warning, and a file
/// that cannot be read admits nobody.
/// Why by reading and not by its date: a date may stand still for two changes in a row, and the file is small.
/// Thread safety: one thread at a time.   Test: tests/net/test_key_file.cpp

#include <filesystem>
#include <string>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope {

class AllowList {
  public:
    static constexpr TimeNs k_look = 250 * k_millisecond_ns;

    [[nodiscard]] static Result<AllowList> open(const std::filesystem::path& path);

    [[nodiscard]] const std::vector<std::string>& keys() const { return keys_; }

    /// Looks at the file if it is time to. Whether keys() are others than before.
    bool changed(TimeNs now);

  private:
    AllowList() = default;

    std::filesystem::path path_;
    std::string text_;       ///< That holds.
    std::string last_read_;  ///< At the last look.
    std::vector<std::string> keys_;
    TimeNs next_look_ = 0;
};

}  // namespace pathscope
