#include "pathscope/net/chaos_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

namespace pathscope {
namespace {

constexpr std::string_view k_blanks = " \t\r";
constexpr TimeNs k_longest = 3600 * k_second_ns;
constexpr int k_highest_port = 65535;

struct Unit {
    std::string_view name;
    double factor;
};
constexpr Unit k_times[] = {{"us", 1e3}, {"ms", 1e6}, {"s", 1e9}};
constexpr Unit k_rates[] = {{"B/s", 1}, {"kB/s", 1e3}, {"MB/s", 1e6}, {"GB/s", 1e9}};

/// The words of a line, taken one by one.
class Words {
  public:
    explicit Words(std::string_view text) : rest_(text) { skip_blanks(); }

    bool empty() const { return rest_.empty(); }
    std::string_view peek() const { return rest_.substr(0, rest_.find_first_of(k_blanks)); }
    std::string_view take() {
        const std::string_view word = peek();
        rest_.remove_prefix(word.size());
        skip_blanks();
        return word;
    }
    bool take_if(std::string_view word) {
        if (peek() != word) return false;
        take();
        return true;
    }
    std::string_view rest() const { return rest_; }

  private:
    void skip_blanks() { rest_.remove_prefix(std::min(rest_.find_first_not_of(k_blanks), rest_.size())); }

    std::string_view rest_;
};

/// "80ms" in the unit's base (nanoseconds, bytes per second); nothing if it is no finite number with such a
/// unit.
template <std::size_t N>
std::optional<double> parse_quantity(std::string_view word, const Unit (&units)[N]) {
    double number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    const std::string_view name = word.substr(std::size_t(end - word.data()));
    const auto unit = std::find_if(units, units + N, [&](const Unit& u) { return u.name == name; });
    if (error != std::errc() || unit == units + N || !std::isfinite(number) || number < 0)
        return std::nullopt;
    return number * unit->factor;
}

Result<TimeNs> parse_time(std::string_view word) {
    const auto ns = parse_quantity(word, k_times);
    if (!ns || *ns > double(k_longest))
        return bad_input(fmt::format("'{}' is no time up to one hour, as in 80ms, 20us or 1.5s.", word));
    return TimeNs(std::llround(*ns));
}

Result<double> parse_rate(std::string_view word) {
    if (word == "off") return 0.0;
    const auto rate = parse_quantity(word, k_rates);
    if (!rate || *rate < 1 || *rate > 1e12)
        return bad_input(fmt::format("'{}' is no rate from 1B/s, as in 500kB/s or 1MB/s, nor off.", word));
    return *rate;
}

Result<double> parse_probability(std::string_view word) {
    if (word == "off") return 0.0;
    double p = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), p);
    if (error != std::errc() || end != word.data() + word.size() || !(p >= 0 && p <= 1))
        return bad_input(fmt::format("'{}' is no probability from 0 to 1, as in 1e-6.", word));
    return p;
}

Result<bool> parse_switch(std::string_view word) {
    if (word != "on" && word != "off") return bad_input(fmt::format("'{}' is neither on nor off.", word));
    return word == "on";
}

Result<int> parse_number(std::string_view word, int highest) {
    int number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || number < 1 || number > highest)
        return bad_input(fmt::format("'{}' is no number from 1 to {}.", word, highest));
    return number;
}

/// The fault that a value makes, or the value's error.
template <class Fault, class Value>
Result<ChaosFault> made_of(const Result<Value>& value) {
    if (!value) return value.error();
    return ChaosFault(Fault{*value});
}

Result<ChaosFault> parse_delay(Words& words) {
    const auto delay = parse_time(words.take());
    if (!delay) return delay.error();
    if (!words.take_if("jitter")) return ChaosFault(fault::Delay{*delay, 0});
    const auto jitter = parse_time(words.take());
    if (!jitter) return jitter.error();
    return ChaosFault(fault::Delay{*delay, *jitter});
}

Result<ChaosFault> parse_fault(Words& words) {
    const std::string_view name = words.take();
    if (name == "delay") return parse_delay(words);
    if (name == "rate") return made_of<fault::Rate>(parse_rate(words.take()));
    if (name == "flip") return made_of<fault::Flip>(parse_probability(words.take()));
    if (name == "black-hole") return made_of<fault::BlackHole>(parse_switch(words.take()));
    if (name == "cut") return ChaosFault(fault::Cut{});
    if (name == "half-close") return ChaosFault(fault::HalfClose{});
    if (name == "refuse") return made_of<fault::Refuse>(parse_switch(words.take()));
    if (name == "clear") return ChaosFault(fault::Clear{});
    return bad_input(
        fmt::format("'{}' is no fault; there are delay, rate, flip, black-hole, cut, half-close, "
                    "refuse and clear.",
                    name));
}

/// A connection is reset or refused as a whole.
bool has_directions(const ChaosFault& fault) {
    return !std::holds_alternative<fault::Cut>(fault) && !std::holds_alternative<fault::Refuse>(fault);
}

Result<void> parse_scope(Words& words, ChaosCommand& command) {
    while (!words.empty()) {
        const std::string_view word = words.take();
        const bool up = word == "up", down = word == "down";
        if (word == "both") {
            command.directions = {true, true};
        } else if (up || down) {
            if (!has_directions(command.fault))
                return bad_input(
                    fmt::format("'{}': this fault takes both directions; half-close takes one.", word));
            command.directions = {up, down};
        } else if (word == "link" || word == "port") {
            const auto number = parse_number(words.take(), k_highest_port);
            if (!number) return bad_input(fmt::format("{}: {}", word, number.error().message));
            (word == "link" ? command.link : command.port) = *number;
        } else {
            return bad_input(fmt::format(
                "'{}' is not understood here; up, down, both, link N or port N may follow.", word));
        }
    }
    return {};
}

}  // namespace

Result<ChaosCommand> parse_chaos_command(std::string_view text) {
    Words words(text);
    if (!words.take_if("fault"))
        return bad_input(
            fmt::format("'{}' is no command; one begins with fault, as in fault delay 80ms.", words.peek()));
    ChaosCommand command;
    auto fault = parse_fault(words);
    if (!fault) return fault.error();
    command.fault = *fault;
    if (const auto scope = parse_scope(words, command); !scope) return scope.error();
    return command;
}

Result<std::vector<ScheduledChaos>> parse_chaos_schedule(std::string_view text) {
    std::vector<ScheduledChaos> schedule;
    for (int number = 1; !text.empty(); ++number) {
        const std::string_view line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(line.size() + 1, text.size()));
        Words words(line.substr(0, line.find('#')));
        if (words.empty()) continue;

        const auto at = parse_time(words.take());
        if (!at) return bad_input(fmt::format("line {}: {}", number, at.error().message));
        auto command = parse_chaos_command(words.rest());
        if (!command) return bad_input(fmt::format("line {}: {}", number, command.error().message));
        schedule.push_back({*at, *command, number});
    }
    std::stable_sort(schedule.begin(), schedule.end(),
                     [](const auto& a, const auto& b) { return a.at < b.at; });
    return schedule;
}

}  // namespace pathscope
