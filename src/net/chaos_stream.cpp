#include "pathscope/net/chaos_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::uint64_t k_golden_ratio = 0x9e3779b97f4a7c15u;
constexpr std::uint64_t k_never = std::numeric_limits<std::uint64_t>::max();

std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

}  // namespace

void ChaosCounts::add(const ChaosCounts& other) {
    bytes_in += other.bytes_in;
    bytes_out += other.bytes_out;
    bytes_dropped += other.bytes_dropped;
    flips += other.flips;
    most_held_bytes = std::max(most_held_bytes, other.most_held_bytes);
}

std::uint64_t ChaosDraws::next() { return mix(state_ += k_golden_ratio); }

double ChaosDraws::next_unit() { return double(next() >> 11) * 0x1p-53; }

ChaosStream::ChaosStream(std::uint64_t seed, std::size_t capacity)
    : capacity_(capacity),
      jitter_draws_(mix(seed)),
      flip_draws_(mix(~seed)),
      next_flip_(k_never),
      last_due_(std::numeric_limits<TimeNs>::min()) {
    CHECK(capacity > 0);
}

void ChaosStream::set_faults(const ChaosFaults& faults, TimeNs now) {
    const bool other_flips = faults.flip_probability != faults_.flip_probability;
    const bool other_rate = faults.bytes_per_second != faults_.bytes_per_second;
    faults_ = faults;
    if (other_flips) draw_next_flip(taken_);
    if (other_rate) bucket_.set_limit(line_limit(faults.bytes_per_second), now);

    // The least of due times in order and one bound is in order.
    const TimeNs latest = now + faults.delay + faults.jitter;
    for (Chunk& chunk : chunks_) chunk.due = std::min(chunk.due, latest);
    if (end_due_) end_due_ = std::min(*end_due_, latest);
    last_due_ = std::min(last_due_, latest);
}

std::size_t ChaosStream::room() const {
    if (end_due_) return capacity_;
    return chunks_.size() >= k_most_chunks ? 0 : capacity_ - queue_.size();
}

void ChaosStream::push(std::span<const std::byte> bytes, TimeNs now) {
    CHECK(bytes.size() <= room(), bytes.size(), room());
    if (bytes.empty()) return;
    counts_.bytes_in += bytes.size();
    if (end_due_) {
        counts_.bytes_dropped += bytes.size();
        return;
    }
    queue_.append(bytes);
    flip_bytes(taken_, taken_ + bytes.size());
    taken_ += bytes.size();
    counts_.most_held_bytes = std::max<std::uint64_t>(counts_.most_held_bytes, queue_.size());

    // Chunks that are due at the same time are one.
    const TimeNs due = draw_due(now);
    if (!chunks_.empty() && chunks_.back().due == due)
        chunks_.back().end = taken_;
    else
        chunks_.push_back({taken_, due});
}

void ChaosStream::end(TimeNs now) {
    if (!end_due_) end_due_ = draw_due(now);
}

TimeNs ChaosStream::draw_due(TimeNs now) {
    const auto jitter = TimeNs(jitter_draws_.next_unit() * double(faults_.jitter));
    return last_due_ = std::max(last_due_, now + faults_.delay + jitter);
}

/// The gap to the next flipped byte has the geometric distribution P(gap >= n) = (1-p)^n. It has no memory,
/// so that it may be drawn anew wherever p changes, and costs nothing for the bytes in between.
void ChaosStream::draw_next_flip(std::uint64_t from) {
    const double p = faults_.flip_probability;
    next_flip_ = k_never;
    if (p <= 0) return;
    const double gap = p >= 1 ? 0 : std::floor(std::log1p(-flip_draws_.next_unit()) / std::log1p(-p));
    if (gap < 1e18) next_flip_ = from + std::uint64_t(gap);
}

void ChaosStream::flip_bytes(std::uint64_t begin, std::uint64_t end) {
    while (next_flip_ < end) {
        CHECK(next_flip_ >= begin, next_flip_, begin);
        queue_[std::size_t(next_flip_ - left_)] ^= std::byte(1u << (flip_draws_.next() >> 61));
        ++counts_.flips;
        draw_next_flip(next_flip_ + 1);
    }
}

/// Under a rate, bytes wait until there is a share of them worth waking up for, a quarter of the depth, so that a sleeper who
/// comes late loses nothing. Depends on the first chunk alone, so that the time
/// next_due() names is one at which ready() has something.
std::size_t ChaosStream::worth_sending() const {
    const auto first =
        std::size_t(std::min<std::uint64_t>(chunks_.front().end - left_, queue_.front().size()));
    const auto share = std::size_t(std::max(1.0, bucket_.limit().depth / 4));
    return bucket_.limit().limits() ? std::min(first, share) : 1;
}

std::span<const std::byte> ChaosStream::ready(TimeNs now) const {
    if (faults_.black_hole || chunks_.empty() || chunks_.front().due > now) return {};
    const std::size_t allowed = bucket_.available(now);
    if (allowed < worth_sending()) return {};

    const std::span<const std::byte> front = queue_.front();
    std::uint64_t due_end = left_;
    for (const Chunk& chunk : chunks_) {
        if (chunk.due > now || due_end - left_ >= front.size()) break;
        due_end = chunk.end;
    }
    return front.first(std::size_t(std::min<std::uint64_t>({due_end - left_, front.size(), allowed})));
}

void ChaosStream::pop(std::size_t count, TimeNs now) {
    queue_.pop(count);
    bucket_.take(count, now);
    left_ += count;
    counts_.bytes_out += count;
    while (!chunks_.empty() && chunks_.front().end <= left_) chunks_.pop_front();
}

bool ChaosStream::finished(TimeNs now) const {
    return end_due_ && *end_due_ <= now && queue_.empty() && !faults_.black_hole;
}

std::optional<TimeNs> ChaosStream::next_due(TimeNs now) const {
    if (faults_.black_hole) return std::nullopt;
    if (!chunks_.empty()) return bucket_.time_of(worth_sending(), std::max(now, chunks_.front().due));
    if (end_due_) return std::max(now, *end_due_);
    return std::nullopt;
}

void ChaosStream::abandon() {
    counts_.bytes_dropped += queue_.size();
    left_ = taken_;
    queue_.pop(queue_.size());
    chunks_.clear();
}

}  // namespace pathscope
