#pragma once
/// The event store as a trace for ui.perfetto.dev or chrome://tracing: one process per server, its leases as
/// bars, arrows from grant to bar to commit, instants for messages and state changes, counters as curves.
///
/// Format: Chrome Trace Event Format (JSON object with "traceEvents"); times in microseconds from the first
/// event. Leases of one server overlap (it holds as many as it has credits), and bars of one line must nest:
/// so each process has as many lines "leases 1", "leases 2"... as were held at once. The client's lines
/// "grants" and "commits" show moments as bars of at most one microsecond, because arrows start and end in
/// bars. A lease whose grant fell off the ring has no bar; one that never ended reaches to the last event.
/// Thread safety: yes.   Test: tests/probe/test_trace_export.cpp

#include <filesystem>
#include <string>

#include "pathscope/core/result.hpp"
#include "pathscope/probe/event_store.hpp"

namespace pathscope {

[[nodiscard]] std::string trace_json(const EventStore& store);

/// For `--trace F`.
[[nodiscard]] Result<void> write_trace(const EventStore& store, const std::filesystem::path& path);

}  // namespace pathscope
