#include "pathscope/probe/trace_export.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <variant>
#include <vector>

#include "pathscope/core/files.hpp"

namespace pathscope {
namespace {

using Json = nlohmann::json;

// Lines (the format's "threads") of a process. A track of the store is the line of the same number.
constexpr std::uint32_t k_line_grants = 1000;
constexpr std::uint32_t k_line_commits = 1001;
constexpr std::uint32_t k_line_messages = 1002;
constexpr std::uint32_t k_line_commands = 1003;
constexpr std::uint32_t k_line_checks = 1004;
constexpr std::uint32_t k_line_leases = 2000;  ///< And the next numbers.

constexpr TimeNs k_mark_ns = k_microsecond_ns;

/// A lease from grant to end.
struct Bar {
    UnitEvent grant;
    TimeNs begin = 0;
    TimeNs end = 0;
    std::string ended = "open";
    bool arrow_ends_at_commit = false;
    std::uint32_t lane = 0;
};

/// A moment on the client's "grants" or "commits" line.
struct Mark {
    TimeNs time = 0;
    UnitEvent unit;
};

struct Trace {
    TimeNs origin = 0;
    TimeNs last = 0;
    std::map<LeaseId, Bar> bars;
    std::vector<Mark> grants, commits;
    std::set<std::pair<ServerId, std::uint32_t>> lines;
    std::string text;
};

// The format's process 0 is the idle task of the kernel, so that ours count from 1.
std::uint32_t pid_of(ServerId process) { return process.value + 1; }

double microseconds(const Trace& trace, TimeNs time) {
    return static_cast<double>(time - trace.origin) * 1e-3;
}

void write(Trace& trace, const Json& event) {
    if (!trace.text.empty()) trace.text += ",\n";
    // What peers sent need not be UTF-8; the trace has to be.
    trace.text += event.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json event_at(Trace& trace, const char* phase, std::string_view name, TimeNs time, ServerId process,
              std::uint32_t line) {
    trace.lines.emplace(process, line);
    return {{"ph", phase},
            {"name", name},
            {"ts", microseconds(trace, time)},
            {"pid", pid_of(process)},
            {"tid", line}};
}

void write_bar(Trace& trace, std::string_view name, TimeNs time, TimeNs duration, ServerId process,
               std::uint32_t line, Json args) {
    Json event = event_at(trace, "X", name, time, process, line);
    event["dur"] = static_cast<double>(duration) * 1e-3;
    event["args"] = std::move(args);
    write(trace, event);
}

void write_instant(Trace& trace, std::string_view name, const Event& at, ServerId process, std::uint32_t line,
                   const char* scope, Json args) {
    Json event = event_at(trace, "i", name, at.time, process, line);
    event["s"] = scope;
    event["args"] = std::move(args);
    write(trace, event);
}

/// One end ("s", "f") or joint ("t") of a lease's arrow.
void write_arrow(Trace& trace, const char* phase, LeaseId lease, TimeNs time, ServerId process,
                 std::uint32_t line) {
    Json event = event_at(trace, phase, "lease", time, process, line);
    event["cat"] = "lease";
    event["id"] = lease.value;
    if (*phase == 'f') event["bp"] = "e";
    write(trace, event);
}

Json args_of(const UnitEvent& unit) {
    return {{"lease", unit.lease.value},
            {"epoch", unit.epoch.value},
            {"unit", unit.unit},
            {"first", unit.first},
            {"count", unit.count},
            {"server", unit.server.value},
            {"change", name_of(unit.change)},
            {"reason", name_of(unit.reason)}};
}

std::string round_name(const UnitEvent& unit) {
    return "unit " + std::to_string(unit.unit) + " [" + std::to_string(unit.first) + ", " +
           std::to_string(unit.first + unit.count) + ")";
}

// -- First walk: when the trace begins and ends, and what became of each lease ------------------------------

void follow_lease(Trace& trace, const Event& event, const UnitEvent& unit) {
    if (unit.change == UnitChange::refused) return;
    if (unit.change == UnitChange::granted || unit.change == UnitChange::copied) {
        trace.bars[unit.lease] = {unit, event.time, event.time, "open", false, 0};
        trace.grants.push_back({event.time, unit});
        return;
    }
    if (unit.change == UnitChange::committed) trace.commits.push_back({event.time, unit});
    const auto found = trace.bars.find(unit.lease);
    if (found == trace.bars.end()) return;
    Bar& bar = found->second;
    if (unit.change == UnitChange::committed) bar.arrow_ends_at_commit = true;
    if (bar.ended != "open") return;
    bar.end = event.time;
    bar.ended = name_of(unit.reason);
}

TimeNs end_of(const Event& event) {
    const SpanEvent* const span = std::get_if<SpanEvent>(&event.body);
    return event.time + (span != nullptr ? span->duration : 0);
}

void survey(Trace& trace, const std::vector<Event>& events) {
    if (events.empty()) return;
    trace.origin = events.front().time;
    trace.last = events.front().time;
    for (const Event& event : events) {
        trace.origin = std::min(trace.origin, event.time);
        trace.last = std::max(trace.last, end_of(event));
        if (const UnitEvent* const unit = std::get_if<UnitEvent>(&event.body))
            follow_lease(trace, event, *unit);
    }
    for (auto& [id, bar] : trace.bars)
        if (bar.ended == "open") bar.end = trace.last;
}

/// Puts overlapping leases of a server on different lines: each on the first line that is free when it
/// begins.
void choose_lanes(Trace& trace) {
    std::vector<Bar*> by_begin;
    for (auto& [id, bar] : trace.bars) by_begin.push_back(&bar);
    std::stable_sort(by_begin.begin(), by_begin.end(),
                     [](const Bar* a, const Bar* b) { return a->begin < b->begin; });
    std::map<ServerId, std::vector<TimeNs>> lane_ends;
    for (Bar* const bar : by_begin) {
        std::vector<TimeNs>& ends = lane_ends[bar->grant.server];
        const auto free =
            std::find_if(ends.begin(), ends.end(), [&](TimeNs end) { return end <= bar->begin; });
        bar->lane = static_cast<std::uint32_t>(free - ends.begin());
        if (free == ends.end())
            ends.push_back(bar->end);
        else
            *free = bar->end;
    }
}

// -- Second walk: writing -----------------------------------------------------------------------------------

/// Marks last a microsecond, or until the next one: bars of one line must not overlap.
void write_marks(Trace& trace, std::vector<Mark>& marks, std::uint32_t line) {
    std::stable_sort(marks.begin(), marks.end(),
                     [](const Mark& a, const Mark& b) { return a.time < b.time; });
    for (std::size_t i = 0; i < marks.size(); ++i) {
        const TimeNs room = i + 1 < marks.size() ? marks[i + 1].time - marks[i].time : k_mark_ns;
        write_bar(trace, round_name(marks[i].unit), marks[i].time, std::min(room, k_mark_ns), k_local_server,
                  line, args_of(marks[i].unit));
    }
}

void write_leases(Trace& trace) {
    for (const auto& [id, bar] : trace.bars) {
        const std::uint32_t line = k_line_leases + bar.lane;
        Json args = args_of(bar.grant);
        args["ended"] = bar.ended;
        write_bar(trace, round_name(bar.grant), bar.begin, bar.end - bar.begin, bar.grant.server, line,
                  std::move(args));
        write_arrow(trace, "s", id, bar.begin, k_local_server, k_line_grants);
        write_arrow(trace, bar.arrow_ends_at_commit ? "t" : "f", id, bar.begin, bar.grant.server, line);
    }
    for (const Mark& commit : trace.commits)
        if (trace.bars.contains(commit.unit.lease))
            write_arrow(trace, "f", commit.unit.lease, commit.time, k_local_server, k_line_commits);
}

void write_body(Trace& trace, const Event& at, const SpanEvent& span) {
    Json args = Json::object();
    if (span.lease.value != 0) args["lease"] = span.lease.value;
    write_bar(trace, span.name.view(), at.time, span.duration, at.process, at.track, std::move(args));
    if (trace.bars.contains(span.lease)) write_arrow(trace, "t", span.lease, at.time, at.process, at.track);
}

void write_body(Trace& trace, const Event& at, const CounterEvent& counter) {
    Json event = event_at(trace, "C", name_of(counter.counter), at.time, at.process, at.track);
    event["args"] = {{"total", counter.total}};
    write(trace, event);
}

void write_body(Trace& trace, const Event& at, const MessageEvent& message) {
    write_instant(trace, message.type.view(), at, at.process, k_line_messages, "t",
                  {{"way", name_of(message.way)},
                   {"socket", message.socket.view()},
                   {"peer", message.peer.value},
                   {"bytes", message.bytes},
                   {"detail", message.detail.view()}});
}

void write_body(Trace& trace, const Event& at, const StateEvent& state) {
    std::string name(state.from.view());
    name += " > ";
    name += state.to.view();
    write_instant(trace, name, at, state.subject, at.track, "p",
                  {{"machine", state.machine.view()}, {"reason", state.reason.view()}});
}

void write_body(Trace& trace, const Event& at, const UnitEvent& unit) {
    // Grants and commits are bars; what is left to show are the refusals and the ends without a result.
    if (unit.change == UnitChange::granted || unit.change == UnitChange::copied ||
        unit.change == UnitChange::committed)
        return;
    write_instant(trace, name_of(unit.reason), at, k_local_server, k_line_commits, "t", args_of(unit));
}

void write_body(Trace& trace, const Event& at, const CheckEvent& check) {
    write_instant(trace, check.expression.view(), at, at.process, k_line_checks, "t",
                  {{"outcome", name_of(check.outcome)}});
}

void write_body(Trace& trace, const Event& at, const CommandEvent& command) {
    write_instant(trace, command.text.view(), at, at.process, k_line_commands, "g",
                  {{"origin", command.origin.view()}});
}

void write_body(Trace& trace, const Event& at, const NoteEvent& note) {
    write_instant(trace, note.text.view(), at, at.process, at.track, "p", Json::object());
}

std::string name_of_line(std::uint32_t line) {
    switch (line) {
        case k_line_grants:
            return "grants";
        case k_line_commits:
            return "commits";
        case k_line_messages:
            return "messages";
        case k_line_commands:
            return "commands";
        case k_line_checks:
            return "checks";
        default:
            break;
    }
    if (line >= k_line_leases) return "leases " + std::to_string(line - k_line_leases + 1);
    return line == 0 ? "main" : "track " + std::to_string(line);
}

std::string name_of_process(const EventStore& store, ServerId process) {
    if (process == k_local_server) return "client";
    const std::optional<ServerSummary> known = store.server(process);
    if (known && !known->name.empty()) return "server " + std::to_string(process.value) + " " + known->name;
    return "server " + std::to_string(process.value);
}

void write_names(Trace& trace, const EventStore& store) {
    const auto metadata = [&](const char* what, ServerId process, std::uint32_t line, Json args) {
        write(trace, {{"ph", "M"},
                      {"name", what},
                      {"pid", pid_of(process)},
                      {"tid", line},
                      {"args", std::move(args)}});
    };
    std::set<ServerId> processes;
    for (const auto& [process, line] : trace.lines) {
        metadata("thread_name", process, line, {{"name", name_of_line(line)}});
        metadata("thread_sort_index", process, line, {{"sort_index", line}});
        processes.insert(process);
    }
    for (const ServerId process : processes) {
        metadata("process_name", process, 0, {{"name", name_of_process(store, process)}});
        metadata("process_sort_index", process, 0, {{"sort_index", process.value}});
    }
}

}  // namespace

std::string trace_json(const EventStore& store) {
    std::vector<Event> events;
    store.visit_since(0, [&](const Event& event) { events.push_back(event); });

    Trace trace;
    survey(trace, events);
    choose_lanes(trace);
    write_marks(trace, trace.grants, k_line_grants);
    write_marks(trace, trace.commits, k_line_commits);
    write_leases(trace);
    for (const Event& event : events)
        std::visit([&](const auto& body) { write_body(trace, event, body); }, event.body);
    write_names(trace, store);

    const Json other = {{"events_fallen_off", store.fallen_off()}, {"origin_ns", trace.origin}};
    return "{\"displayTimeUnit\":\"ms\",\"otherData\":" + other.dump() + ",\"traceEvents\":[\n" + trace.text +
           "\n]}\n";
}

Result<void> write_trace(const EventStore& store, const std::filesystem::path& path) {
    return write_file_atomically(path, trace_json(store));
}

}  // namespace pathscope
