#pragma once
/// What a person sees of a benchmark: a table at the end, and before it one line that says what is being measured.

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

namespace pathscope::bench {

/// Columns as wide as their widest cell; the first is text, and flush left.
class TextTable {
  public:
    using Row = std::vector<std::string>;

    explicit TextTable(Row head) { rows_.push_back(std::move(head)); }
    void add(Row row) { rows_.push_back(std::move(row)); }

    void print() const {
        std::vector<std::size_t> widths(rows_.front().size());
        for (const Row& row : rows_)
            for (std::size_t i = 0; i < widths.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
        for (const Row& row : rows_) {
            fmt::print("{:<{}}", row[0], widths[0]);
            for (std::size_t i = 1; i < widths.size(); ++i) fmt::print("  {:>{}}", row[i], widths[i]);
            fmt::print("\n");
        }
    }

  private:
    std::vector<Row> rows_;
};

/// One line of a terminal, written over; nothing where standard error is none.
inline void show_progress(std::string_view doing) {
    if (::isatty(STDERR_FILENO) == 0) return;
    fmt::print(stderr, "\r\033[K{}", doing);
    std::fflush(stderr);
}

}  // namespace pathscope::bench
