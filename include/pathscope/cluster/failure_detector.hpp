#pragma once
/// Failure detectors: is a server that has gone silent dead, or only late?
///
///   fixed     the classic system: a beat every six seconds; who has not answered by the next beat is dead.
///             A death is seen 6 to 12 s after the last answer.
///   adaptive  phi accrual: how unlikely is this silence, given the gaps seen so far?
///
///                 phi(silence) = -log10 P(gap > silence),   gap ~ Normal(mean + pause, sigma)
///
///             phi = 1: one such gap in 10 is longer than this silence; phi = 8: one in 100,000,000.
///             Suspect at phi >= 4 (a second server may be given the same round: harmless), dead at phi >= 8.
///             With beats every 250 ms and little jitter: suspect after 0.64 s of silence, dead after
///             0.73 s. With jitter, the window widens sigma, and the limits move out by themselves.
///
/// Why `pause`: a server on a busy machine stops for a moment now and then, without jitter before it. Why a
/// floor for sigma: after 64 perfect beats the estimate would be near 0, and the first late one a death.
/// No clock: `now` is an argument and never falls. Thread safety: one thread at a time.
/// See: Hayashibara et al. 2004, "The phi accrual failure detector".
/// Test: tests/cluster/test_failure_detector.cpp

#include <array>
#include <cstddef>
#include <variant>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/enum_names.hpp"

namespace pathscope {

enum class DetectorKind { fixed, adaptive };

inline constexpr std::array k_detector_names{
    EnumName{DetectorKind::fixed, "fixed"},
    EnumName{DetectorKind::adaptive, "adaptive"},
};
constexpr const auto& enum_table(DetectorKind) { return k_detector_names; }

enum class Liveness { alive, suspect, dead };

inline constexpr std::array k_liveness_names{
    EnumName{Liveness::alive, "alive"},
    EnumName{Liveness::suspect, "suspect"},
    EnumName{Liveness::dead, "dead"},
};
constexpr const auto& enum_table(Liveness) { return k_liveness_names; }

struct Suspicion {
    Liveness state = Liveness::alive;
    double level = 0;    ///< adaptive: phi. fixed: beats missed.
    TimeNs silence = 0;  ///< Since the last sign of life.
};

struct FixedDetectorParams {
    TimeNs period = 6 * k_second_ns;
};

class FixedDetector {
  public:
    explicit FixedDetector(TimeNs now, FixedDetectorParams params = {});
    void on_heartbeat(TimeNs now);
    void on_traffic(TimeNs now);
    void excuse(TimeNs pause);
    [[nodiscard]] Suspicion assess(TimeNs now) const;

  private:
    FixedDetectorParams params_;
    TimeNs first_beat_;
    TimeNs last_sign_;
};

struct AdaptiveDetectorParams {
    TimeNs expected_interval = 250 * k_millisecond_ns;  ///< Assumed until gaps are seen.
    TimeNs sigma_floor = 50 * k_millisecond_ns;
    TimeNs pause = 200 * k_millisecond_ns;
    double suspect_phi = 4;
    double dead_phi = 8;
};

class AdaptiveDetector {
  public:
    static constexpr std::size_t k_window = 64;  ///< Gaps remembered.

    explicit AdaptiveDetector(TimeNs now, AdaptiveDetectorParams params = {});
    void on_heartbeat(TimeNs now);
    void on_traffic(TimeNs now);
    void excuse(TimeNs pause);
    [[nodiscard]] Suspicion assess(TimeNs now) const;

    /// phi of a silence that long.
    [[nodiscard]] double phi(TimeNs silence) const;

  private:
    void add_gap(TimeNs gap);

    AdaptiveDetectorParams params_;
    std::array<TimeNs, k_window> gaps_{};
    std::size_t gaps_seen_ = 0;
    double mean_ = 0, sigma_ = 0;  ///< Of the gaps in the window, in nanoseconds.
    TimeNs last_beat_;
    TimeNs last_sign_;
};

/// Either of them, chosen by name.
class FailureDetector {
  public:
    FailureDetector(DetectorKind kind, TimeNs now);
    explicit FailureDetector(FixedDetector detector) : detector_(detector) {}
    explicit FailureDetector(AdaptiveDetector detector) : detector_(detector) {}

    /// A heartbeat arrived: the server lives, and the gap teaches what to expect.
    void on_heartbeat(TimeNs now);

    /// Anything else arrived: the server lives, but results say nothing about the rhythm of beats.
    void on_traffic(TimeNs now);

    /// This process itself did not run for a while (stopped, suspended, overloaded): that silence is its own,
    /// and proves nothing about servers.
    void excuse(TimeNs pause);

    [[nodiscard]] Suspicion assess(TimeNs now) const;
    [[nodiscard]] DetectorKind kind() const;

  private:
    std::variant<FixedDetector, AdaptiveDetector> detector_;
};

}  // namespace pathscope
