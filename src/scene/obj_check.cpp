#include "obj_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "text_scan.hpp"

namespace pathscope {
namespace {

constexpr std::uint32_t k_max_corners_of_face = 65'536;
/// Of each kind; tinyobjloader keeps an index in an int, a mesh holds 2^30 triangles.
constexpr std::size_t k_max_elements = std::size_t{1} << 30;

std::string shown(std::string_view word) {
    return std::string(word.substr(0, 40)) + (word.size() > 40 ? "..." : "");
}

/// Whether a number that is finite, like 0e999, is none to tinyobjloader, which multiplies by powers of ten.
bool has_huge_exponent(std::string_view word) {
    const std::size_t e = word.find_first_of("eE");
    return e != std::string_view::npos && number_of(word.substr(e + 1)).value_or(0) > 300;
}

class ObjChecker {
  public:
    ObjChecker(std::string& text, const std::vector<std::size_t>& joined, const std::string& shown_path)
        : text_(text), joined_(joined), shown_path_(shown_path) {}

    Result<ObjOutline> run() {
        outline_.smoothing.push_back({0, 0});
        if (const std::size_t zero = text_.find('\0'); zero != std::string::npos) {
            offset_ = zero;
            return error("is no text from here on; the file is damaged, or no OBJ.");
        }
        for (std::string_view rest = text_; !rest.empty() && !error_;) {
            offset_ = text_.size() - rest.size();
            check_line(take_line(rest));
        }
        check_ranges();
        if (!error_ && outline_.faces == 0) fail_file("has no faces (lines that begin with f).");
        if (error_) return *error_;
        return std::move(outline_);
    }

  private:
    /// Positive indices may point forwards; the largest is looked at when all is read.
    struct IndexRange {
        const char* kind;
        const char* statement;
        std::int64_t largest = 0;
        std::size_t largest_offset = 0;
    };

    Error error(std::string_view sentence) const {
        const auto is_newline = [this](std::size_t i) {
            return text_[i] == '\n' || (text_[i] == '\r' && (i + 1 == text_.size() || text_[i + 1] != '\n'));
        };
        std::size_t line = 1;
        for (std::size_t i = 0; i < offset_; ++i) line += is_newline(i);
        line += std::size_t(std::count_if(joined_.begin(), joined_.end(),
                                          [this](std::size_t joint) { return joint < offset_; }));
        return bad_input(fmt::format("{}:{}: {}", shown_path_, line, sentence));
    }
    void fail(std::string_view sentence) {
        if (!error_) error_ = error(sentence);
    }
    void fail_file(std::string_view sentence) {
        error_ = bad_input(fmt::format("{} {}", shown_path_, sentence));
    }

    void check_line(std::string_view line) {
        const std::string_view keyword = take_word(line);
        if (keyword == "v") {
            count(outline_.positions);
            check_numbers("v", line, 3, true);
        } else if (keyword == "vn") {
            count(outline_.normals);
            if (!check_numbers("vn", line, 3, false))
                outline_.not_finite_normals.push_back(outline_.normals - 1);
        } else if (keyword == "vt") {
            count(outline_.uvs);
            check_numbers("vt", line, 1, true);
        } else if (keyword == "f") {
            count(outline_.faces);
            check_face(line);
        } else if (keyword == "s") {
            note_smoothing(take_word(line));
        } else if (keyword == "mtllib") {
            outline_.material_files.emplace_back(rest_of(line));
        }
    }

    void count(std::uint32_t& elements) {
        if (++elements > k_max_elements) fail("more elements than can be numbered; split the file.");
    }

    /// Whether all numbers are finite; in other than `must_be_finite` places that is no error.
    bool check_numbers(const char* statement, std::string_view line, int least, bool must_be_finite) {
        constexpr double k_largest = std::numeric_limits<float>::max();
        bool finite = true;
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = take_word(line);
            if (word.empty() || (i >= least && word.starts_with('#'))) {
                if (i < least)
                    fail(fmt::format("\"{}\" needs {} number{} and has {}; the file is cut off or damaged.",
                                     statement, least, least == 1 ? "" : "s", i));
                break;
            }
            const std::optional<double> number = number_of(word);
            if (!number) {
                fail(fmt::format("\"{}\" is not a number.", shown(word)));
                break;
            }
            finite = finite && std::abs(*number) <= k_largest;
            if (!finite && must_be_finite)
                fail(fmt::format("\"{}\" is not a finite number; export the mesh again without it.",
                                 shown(word)));
            if (finite && has_huge_exponent(word))
                fail(fmt::format("\"{}\" has a larger exponent than is read; write the number without it.",
                                 shown(word)));
        }
        return finite;
    }

    void check_face(std::string_view line) {
        std::uint32_t corners = 0;
        for (;;) {
            std::string_view word = take_word(line);
            if (word.empty() || word.front() == '#') break;
            if (!check_corner(word)) {
                fail(fmt::format(
                    "\"{}\" is not a corner; write a face as f 1 2 3, 1/1 ..., 1//1 ... or 1/1/1 ...",
                    shown(word)));
                return;
            }
            if (error_) return;
            ++corners;
        }
        if (corners < 3)
            fail(fmt::format(
                "a face needs at least three corners and has {}; the file is cut off or damaged.", corners));
        if (corners > k_max_corners_of_face)
            fail(fmt::format("a face of {} corners; at most {} are read.", corners, k_max_corners_of_face));
        outline_.corners += corners;
        if (outline_.corners > k_max_elements) fail("more corners than can be numbered; split the file.");
    }

    /// v, v/vt, v//vn or v/vt/vn, where parts after the first may be empty.
    bool check_corner(std::string_view word) {
        const std::uint32_t counts[3] = {outline_.positions, outline_.uvs, outline_.normals};
        for (std::size_t part = 0; part < 3; ++part) {
            const std::size_t slash = std::min(word.find('/'), word.size());
            const std::string_view index = word.substr(0, slash);
            if (index.empty() ? part == 0 : !check_index(index, ranges_[part], counts[part])) return false;
            if (slash == word.size()) return true;
            word.remove_prefix(slash + 1);
            if (word.find_first_not_of('/') == std::string_view::npos) return blank_out(word, part);
        }
        return false;
    }

    /// Some exporters write 1// or 1/1/; tinyobjloader would take the next corner for what is missing.
    bool blank_out(std::string_view slashes, std::size_t part) {
        if (part + slashes.size() >= 2) return false;
        char* const first = text_.data() + (slashes.data() - text_.data()) - 1;
        std::fill_n(first, slashes.size() + 1, ' ');
        return true;
    }

    bool check_index(std::string_view word, IndexRange& range, std::uint32_t count_so_far) {
        if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
        std::int64_t index = 0;
        const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), index);
        if (failure == std::errc::invalid_argument || end != word.data() + word.size()) return false;
        if (failure == std::errc::result_out_of_range) index = std::numeric_limits<std::int64_t>::max();
        if (index == 0) fail("a face has the index 0; indices start at 1.");
        if (index < 0 && -index > std::int64_t(count_so_far))
            fail(fmt::format("a face has the {} index {}, but only {} \"{}\" lines come before it.",
                             range.kind, index, count_so_far, range.statement));
        if (index > range.largest) {
            range.largest = index;
            range.largest_offset = offset_;
        }
        return true;
    }

    void check_ranges() {
        const std::uint32_t counts[3] = {outline_.positions, outline_.uvs, outline_.normals};
        for (std::size_t part = 0; part < 3; ++part) {
            const IndexRange& range = ranges_[part];
            if (range.largest <= std::int64_t(counts[part])) continue;
            offset_ = range.largest_offset;
            fail(fmt::format("a face has the {} index {}, but the file has only {} \"{}\" lines.", range.kind,
                             range.largest, counts[part], range.statement));
        }
    }

    void note_smoothing(std::string_view word) {
        std::uint32_t group = 0;
        if (word == "on") group = 1;
        std::from_chars(word.data(), word.data() + word.size(), group);  // Anything else is "off".
        if (outline_.smoothing.back().first_face == outline_.faces)
            outline_.smoothing.back().group = group;
        else if (outline_.smoothing.back().group != group)
            outline_.smoothing.push_back({outline_.faces, group});
    }

    std::string& text_;
    const std::vector<std::size_t>& joined_;
    const std::string& shown_path_;
    ObjOutline outline_;
    std::array<IndexRange, 3> ranges_{{{"vertex", "v"}, {"texture", "vt"}, {"normal", "vn"}}};
    std::size_t offset_ = 0;  ///< Of the line that is looked at.
    std::optional<Error> error_;
};

}  // namespace

std::vector<std::size_t> join_continued_lines(std::string& text) {
    std::vector<std::size_t> joined;
    for (std::size_t at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1)) {
        const std::string_view ends = std::string_view(text).substr(at + 1, 2);
        const std::size_t length = ends == "\r\n" ? 2 : !ends.empty() && ends_line(ends[0]) ? 1 : 0;
        if (length == 0) continue;
        joined.push_back(at + length);
        std::fill_n(text.begin() + std::ptrdiff_t(at), length + 1, ' ');
    }
    return joined;
}

Result<ObjOutline> check_obj(std::string& text, const std::vector<std::size_t>& joined,
                             const std::string& shown_path) {
    return ObjChecker(text, joined, shown_path).run();
}

}  // namespace pathscope
