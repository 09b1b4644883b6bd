#pragma once
/// Reading JSON that people write: each value knows its path, so that each error can name it.
///
///     JsonReader root(value, "", problem);
///     camera.vfov_deg = root.need("camera").need("vfov_deg").number();
///     root.refuse_unknown_keys();
///     if (problem.first) return *problem.first;
///
/// Only the first problem is kept; after it, reading goes on with default values, so that a reader of a
/// structure is a straight list of its keys. Every key that was asked for is a known one; refuse_unknown_keys()
/// names any other. Thread safety: one thread.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

struct JsonProblem {
    std::string shown_path;
    std::optional<Error> first;

    void report(std::string_view path, std::string_view sentence) {
        if (first) return;
        first = bad_input(path.empty() ? fmt::format("{}: {}", shown_path, sentence)
                                       : fmt::format("{}: {}: {}", shown_path, path, sentence));
    }
};

class JsonReader {
  public:
    JsonReader(const nlohmann::json& value, std::string path, JsonProblem& problem)
        : value_(&value), path_(std::move(path)), problem_(&problem) {}

    void fail(std::string_view sentence) const { problem_->report(path_, sentence); }
    [[nodiscard]] const std::string& path() const { return path_; }

    // Objects.

    /// The value of a key; nothing if it is absent or this is no object.
    [[nodiscard]] std::optional<JsonReader> find(const std::string& key) {
        asked_.push_back(key);
        if (!expect(value_->is_object(), "an object {...}")) return std::nullopt;
        const auto member = value_->find(key);
        if (member == value_->end()) return std::nullopt;
        return JsonReader(*member, path_.empty() ? key : path_ + "." + key, *problem_);
    }

    [[nodiscard]] JsonReader need(const std::string& key) {
        if (auto member = find(key)) return *member;
        fail(fmt::format("\"{}\" is missing.", key));
        static const nlohmann::json nothing;
        return {nothing, path_, *problem_};
    }

    void refuse_unknown_keys() {
        if (!expect(value_->is_object(), "an object {...}")) return;
        std::sort(asked_.begin(), asked_.end());
        for (const auto& [key, ignored] : value_->items())
            if (!std::binary_search(asked_.begin(), asked_.end(), key))
                problem_->report(path_.empty() ? key : path_ + "." + key,
                                 fmt::format("unknown key; known are {}.", fmt::join(asked_, ", ")));
    }

    /// The keys of an object whose keys are names.
    [[nodiscard]] std::vector<std::pair<std::string, JsonReader>> entries() const {
        std::vector<std::pair<std::string, JsonReader>> result;
        if (!expect(value_->is_object(), "an object {...}")) return result;
        for (const auto& [key, member] : value_->items())
            result.emplace_back(key, JsonReader(member, fmt::format("{}[\"{}\"]", path_, key), *problem_));
        return result;
    }

    // Lists.

    [[nodiscard]] bool is_list() const { return value_->is_array(); }

    [[nodiscard]] std::vector<JsonReader> elements() const {
        std::vector<JsonReader> result;
        if (!expect(value_->is_array(), "a list [...]")) return result;
        for (std::size_t i = 0; i < value_->size(); ++i)
            result.emplace_back((*value_)[i], fmt::format("{}[{}]", path_, i), *problem_);
        return result;
    }

    // Values.

    [[nodiscard]] std::string text() const {
        return expect(value_->is_string(), "a text in quotes") ? value_->get<std::string>() : "";
    }

    [[nodiscard]] bool boolean() const {
        return expect(value_->is_boolean(), "true or false") && value_->get<bool>();
    }

    [[nodiscard]] float number() const {
        if (!expect(value_->is_number(), "a number")) return 0;
        const float number = static_cast<float>(value_->get<double>());
        if (!std::isfinite(number)) fail("too large for a number.");
        return number;
    }

    [[nodiscard]] float number_in(float low, float high) const {
        const float result = number();
        if (result < low || result > high)
            fail(high == std::numeric_limits<float>::max()
                     ? fmt::format("is {}; it must be at least {}.", result, low)
                     : fmt::format("is {}; it must lie between {} and {}.", result, low, high));
        return result;
    }

    [[nodiscard]] float positive_number() const {
        const float result = number();
        if (!(result > 0)) fail(fmt::format("is {}; it must be above 0.", result));
        return result;
    }

    [[nodiscard]] int integer_in(int low, int high) const {
        if (!expect(value_->is_number_integer(), "a whole number")) return low;
        const double wide = value_->get<double>();
        if (!(wide >= low && wide <= high)) {
            fail(fmt::format("is {}; it must lie between {} and {}.", value_->dump(), low, high));
            return low;
        }
        return value_->get<int>();
    }

    [[nodiscard]] Vec3 vector() const {
        if (!expect(value_->is_array() && value_->size() == 3, "a list of three numbers")) return {};
        const auto parts = elements();
        return {parts[0].number(), parts[1].number(), parts[2].number()};
    }

    [[nodiscard]] Vec3 direction() const {
        const Vec3 result = vector();
        const float square = length_squared(result);
        if (!(square > 0 && std::isfinite(square)))
            fail("is zero, or too short or long to tell where it points.");
        return result;
    }

    [[nodiscard]] Rgb colour(float highest = std::numeric_limits<float>::max()) const {
        if (!expect(value_->is_array() && value_->size() == 3, "a list of three numbers")) return {};
        const auto parts = elements();
        return {parts[0].number_in(0, highest), parts[1].number_in(0, highest),
                parts[2].number_in(0, highest)};
    }

  private:
    bool expect(bool fits, std::string_view what) const {
        if (!fits) fail(fmt::format("must be {}, not {}.", what, kind()));
        return fits;
    }

    [[nodiscard]] std::string kind() const {
        if (value_->is_null()) return "null";
        if (value_->is_array()) return fmt::format("a list of {}", value_->size());
        if (value_->is_object()) return "an object";
        const std::string text = value_->dump();
        return text.size() <= 40 ? text : fmt::format("a {}", value_->type_name());
    }

    const nlohmann::json* value_;
    std::string path_;
    JsonProblem* problem_;
    std::vector<std::string> asked_;
};

/// The text as JSON. Refuses a key that stands twice in one object: the reader's eye finds the first, JSON
/// keeps the last. A syntax error is reported with its line and column.
[[nodiscard]] nlohmann::json parse_json(std::string_view text, JsonProblem& problem);

}  // namespace pathscope
