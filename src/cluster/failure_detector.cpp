#include "pathscope/cluster/failure_detector.hpp"

#include <algorithm>
#include <cmath>

#include "pathscope/core/check.hpp"

namespace pathscope {

// -- fixed --------------------------------------------------------------------------------------------------

FixedDetector::FixedDetector(TimeNs now, FixedDetectorParams params)
    : params_(params), first_beat_(now), last_sign_(now) {
    CHECK(params.period > 0, params.period);
}

void FixedDetector::on_heartbeat(TimeNs now) { last_sign_ = std::max(last_sign_, now); }
void FixedDetector::on_traffic(TimeNs now) { last_sign_ = std::max(last_sign_, now); }

void FixedDetector::excuse(TimeNs pause) {
    first_beat_ += pause;
    last_sign_ += pause;
}

// A sign of life between two beats answers the first of them. At the beat after a silent period, it is over.
Suspicion FixedDetector::assess(TimeNs now) const {
    const auto beat_before = [&](TimeNs time) { return (time - first_beat_) / params_.period; };
    const TimeNs missed = std::max<TimeNs>(0, beat_before(now) - beat_before(last_sign_) - 1);
    return {missed > 0 ? Liveness::dead : Liveness::alive, static_cast<double>(missed),
            std::max<TimeNs>(0, now - last_sign_)};
}

// -- adaptive -----------------------------------------------------------------------------------------------

// Until gaps are known, two assumed ones stand for a quarter of jitter.
AdaptiveDetector::AdaptiveDetector(TimeNs now, AdaptiveDetectorParams params)
    : params_(params), last_beat_(now), last_sign_(now) {
    CHECK(params.expected_interval > 0 && params.sigma_floor > 0, params.expected_interval,
          params.sigma_floor);
    add_gap(params.expected_interval - params.expected_interval / 4);
    add_gap(params.expected_interval + params.expected_interval / 4);
}

void AdaptiveDetector::on_heartbeat(TimeNs now) {
    add_gap(std::max<TimeNs>(0, now - last_beat_));
    last_beat_ = std::max(last_beat_, now);
    on_traffic(now);
}

void AdaptiveDetector::on_traffic(TimeNs now) { last_sign_ = std::max(last_sign_, now); }

void AdaptiveDetector::excuse(TimeNs pause) {
    last_beat_ += pause;
    last_sign_ += pause;
}

void AdaptiveDetector::add_gap(TimeNs gap) {
    gaps_[gaps_seen_++ % k_window] = gap;
    const std::size_t known = std::min(gaps_seen_, k_window);
    double sum = 0, sum_of_squares = 0;
    for (std::size_t i = 0; i < known; ++i) sum += static_cast<double>(gaps_[i]);
    mean_ = sum / static_cast<double>(known);
    for (std::size_t i = 0; i < known; ++i) {
        const double deviation = static_cast<double>(gaps_[i]) - mean_;
        sum_of_squares += deviation * deviation;
    }
    sigma_ = std::max(std::sqrt(sum_of_squares / static_cast<double>(known)),
                      static_cast<double>(params_.sigma_floor));
}

// P(gap > silence) = erfc(z / sqrt 2) / 2. Beyond z = 37 that is no double any more: phi stays at 300.
double AdaptiveDetector::phi(TimeNs silence) const {
    constexpr double k_highest = 300;
    const double z = (static_cast<double>(silence - params_.pause) - mean_) / sigma_;
    const double longer = 0.5 * std::erfc(z / std::sqrt(2.0));
    return longer > 1e-300 ? std::max(0.0, -std::log10(longer)) : k_highest;
}

Suspicion AdaptiveDetector::assess(TimeNs now) const {
    Suspicion suspicion;
    suspicion.silence = std::max<TimeNs>(0, now - last_sign_);
    suspicion.level = phi(suspicion.silence);
    if (suspicion.level >= params_.suspect_phi) suspicion.state = Liveness::suspect;
    if (suspicion.level >= params_.dead_phi) suspicion.state = Liveness::dead;
    return suspicion;
}

// -- either -------------------------------------------------------------------------------------------------

FailureDetector::FailureDetector(DetectorKind kind, TimeNs now) : detector_(FixedDetector(now)) {
    if (kind == DetectorKind::adaptive) detector_ = AdaptiveDetector(now);
}

void FailureDetector::on_heartbeat(TimeNs now) {
    std::visit([&](auto& detector) { detector.on_heartbeat(now); }, detector_);
}

void FailureDetector::on_traffic(TimeNs now) {
    std::visit([&](auto& detector) { detector.on_traffic(now); }, detector_);
}

void FailureDetector::excuse(TimeNs pause) {
    std::visit([&](auto& detector) { detector.excuse(pause); }, detector_);
}

Suspicion FailureDetector::assess(TimeNs now) const {
    return std::visit([&](const auto& detector) { return detector.assess(now); }, detector_);
}

DetectorKind FailureDetector::kind() const {
    return std::holds_alternative<FixedDetector>(detector_) ? DetectorKind::fixed : DetectorKind::adaptive;
}

}  // namespace pathscope
