#include "json_reader.hpp"

#include <set>

namespace pathscope {
namespace {

using nlohmann::json;

/// "FILE:LINE:COLUMN: what is wrong", from the library's words and its count of bytes read.
void report_syntax_error(std::string_view text, const json::parse_error& error, JsonProblem& problem) {
    const std::size_t end = std::min(error.byte > 0 ? error.byte - 1 : 0, text.size());
    const std::string_view before = text.substr(0, end);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const std::size_t column = end - (before.rfind('\n') + 1) + 1;

    std::string_view words = error.what();
    if (const std::size_t at = words.find("syntax error"); at != std::string_view::npos)
        words.remove_prefix(at);
    problem.first =
        bad_input(fmt::format("{}:{}:{}: not JSON: {}.", problem.shown_path, line, column, words));
}

/// Notes the keys of each open object, and the first that comes again.
class KeyWatch {
  public:
    bool operator()(json::parse_event_t event, const json& value) {
        if (event == json::parse_event_t::object_start) open_.emplace_back();
        if (event == json::parse_event_t::object_end) open_.pop_back();
        if (event == json::parse_event_t::key && !open_.back().insert(value.get<std::string>()).second)
            if (repeated_.empty()) repeated_ = value.get<std::string>();
        return true;
    }
    [[nodiscard]] const std::string& repeated() const { return repeated_; }

  private:
    std::vector<std::set<std::string>> open_;
    std::string repeated_;
};

}  // namespace

nlohmann::json parse_json(std::string_view text, JsonProblem& problem) {
    try {
        KeyWatch watch;
        json value = json::parse(
            text, [&watch](int, json::parse_event_t event, const json& part) { return watch(event, part); });
        if (!watch.repeated().empty())
            problem.report("", fmt::format("the key \"{}\" stands twice in one object.", watch.repeated()));
        return value;
    } catch (const json::parse_error& error) {
        report_syntax_error(text, error, problem);
    } catch (const json::exception& error) {  // A number beyond double, by the library's own limits.
        problem.report("", fmt::format("not JSON that can be read: {}.", error.what()));
    }
    return {};
}

}  // namespace pathscope
