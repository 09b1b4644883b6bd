#include "pathscope/net/chaos_stream.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <string>
#include <vector>

#include "pathscope/net/byte_queue.hpp"

#include "statistics.hpp"
#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr TimeNs k_ms = k_millisecond_ns;

struct Arrival {
    TimeNs at;
    std::string bytes;
};
struct Departure {
    TimeNs at;
    std::string bytes;
    bool operator==(const Departure&) const = default;
};

std::span<const std::byte> as_bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

std::string pattern(std::size_t size, std::uint64_t seed) {
    ChaosDraws draws(seed);
    std::string text(size, '\0');
    for (char& c : text) c = char(draws.next());
    return text;
}

void check_conservation(const ChaosStream& stream) {
    const ChaosCounts& c = stream.counts();
    REQUIRE(c.bytes_in == c.bytes_out + c.bytes_dropped + stream.held_bytes());
}

/// Takes what is ready at `now`.
std::string take(ChaosStream& stream, TimeNs now) {
    std::string taken;
    for (auto bytes = stream.ready(now); !bytes.empty(); bytes = stream.ready(now)) {
        taken.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        stream.pop(bytes.size(), now);
        check_conservation(stream);
    }
    return taken;
}

/// Runs a stream in virtual time until nothing is left to happen. Each wake-up comes late by lateness().
/// Ensures: nothing was ready before next_due() said so, and something was at that time.
std::vector<Departure> run(
    ChaosStream& stream, const std::vector<Arrival>& arrivals,
    const std::function<TimeNs()>& lateness = [] { return TimeNs(0); }) {
    std::vector<Departure> departures;
    TimeNs now = 0;
    std::size_t next = 0;
    for (;;) {
        const auto due = stream.next_due(now);
        if (!due && next == arrivals.size()) return departures;
        if (next < arrivals.size() && (!due || arrivals[next].at <= *due)) {
            now = std::max(now, arrivals[next].at);
            stream.push(as_bytes(arrivals[next++].bytes), now);
            continue;
        }
        // A fraction of a token is rounded to a nanosecond either way.
        if (*due > now + 1) REQUIRE(stream.ready(*due - 2).empty());
        now = *due + lateness();
        std::string bytes = take(stream, now);
        REQUIRE_FALSE(bytes.empty());
        departures.push_back({now, std::move(bytes)});
    }
}

std::string joined(const auto& events) {
    std::string all;
    for (const auto& event : events) all += event.bytes;
    return all;
}

/// The time of each byte.
std::vector<TimeNs> times_of(const auto& events) {
    std::vector<TimeNs> times;
    for (const auto& event : events) times.insert(times.end(), event.bytes.size(), event.at);
    return times;
}

std::vector<Arrival> random_arrivals(int count, std::size_t most_bytes, TimeNs most_gap, std::uint64_t seed) {
    ChaosDraws draws(seed);
    std::vector<Arrival> arrivals;
    TimeNs at = 0;
    for (int i = 0; i < count; ++i) {
        at += TimeNs(draws.next_unit() * double(most_gap));
        arrivals.push_back({at, pattern(1 + draws.next() % most_bytes, seed + std::uint64_t(i))});
    }
    return arrivals;
}

ChaosStream made(std::uint64_t seed, const ChaosFaults& faults,
                 std::size_t capacity = ChaosStream::k_default_capacity) {
    ChaosStream stream(seed, capacity);
    stream.set_faults(faults, 0);
    return stream;
}

}  // namespace

TEST_CASE("a byte queue gives back what went in, whatever the pieces") {
    ByteQueue queue;
    std::string expected;
    ChaosDraws draws(1);
    for (int i = 0; i < 2000; ++i) {
        if (draws.next() % 2 == 0) {
            const std::string bytes = pattern(draws.next() % 100'000, std::uint64_t(i));
            queue.append(as_bytes(bytes));
            expected += bytes;
        } else {
            const auto front = queue.front();
            REQUIRE(front.empty() == expected.empty());
            const std::size_t count = front.empty() ? 0 : 1 + draws.next() % front.size();
            REQUIRE(
                std::equal(front.begin(), front.begin() + std::ptrdiff_t(count), as_bytes(expected).begin()));
            queue.pop(count);
            expected.erase(0, count);
        }
        REQUIRE(queue.size() == expected.size());
        if (expected.empty()) continue;
        const std::size_t index = draws.next() % expected.size();
        REQUIRE(queue[index] == std::byte(expected[index]));
        if (expected.size() > 500'000) {
            queue.pop(expected.size() - 70'000);
            expected.erase(0, expected.size() - 70'000);
        }
    }
}

TEST_CASE("without faults bytes leave when they come") {
    ChaosStream stream = made(1, {});
    const auto arrivals = random_arrivals(300, 100'000, k_ms, 5);
    const auto departures = run(stream, arrivals);
    CHECK(joined(departures) == joined(arrivals));
    CHECK(times_of(departures) == times_of(arrivals));
    CHECK(stream.counts().flips == 0);
}

TEST_CASE("jitter keeps the order, and each byte's delay within its bounds") {
    const ChaosFaults faults{.delay = 80 * k_ms, .jitter = 20 * k_ms};
    ChaosStream stream = made(7, faults);
    // Gaps far below the jitter: without care, most chunks would overtake.
    const auto arrivals = random_arrivals(5000, 400, k_ms, 6);
    const auto departures = run(stream, arrivals);
    REQUIRE(joined(departures) == joined(arrivals));
    const auto came = times_of(arrivals), left = times_of(departures);
    TimeNs shortest = k_second_ns, longest = 0;
    for (std::size_t i = 0; i < came.size(); ++i) {
        shortest = std::min(shortest, left[i] - came[i]);
        longest = std::max(longest, left[i] - came[i]);
    }
    CHECK(shortest >= faults.delay);
    CHECK(longest < faults.delay + faults.jitter);
    CHECK(longest - shortest > faults.jitter / 2);
}

TEST_CASE("lone chunks have uniform jitter") {
    // Chunks a second apart do not wait for one another, so that their delays are the draws themselves. The
    // test fails a correct program with probability 0.001.
    const ChaosFaults faults{.delay = 10 * k_ms, .jitter = 20 * k_ms};
    ChaosStream stream = made(3, faults);
    std::vector<Arrival> arrivals;
    for (int i = 0; i < 4000; ++i) arrivals.push_back({i * k_second_ns, "x"});
    const auto departures = run(stream, arrivals);
    std::vector<double> observed(20), expected(20, 4000.0 / 20);
    for (std::size_t i = 0; i < departures.size(); ++i)
        ++observed[std::size_t((departures[i].at - arrivals[i].at - faults.delay) * 20 / faults.jitter)];
    CHECK(testing::chi_square_test(observed, expected).p_value > testing::k_significance);
}

TEST_CASE("no span of time sees more than rate times span plus depth, and the rate is reached") {
    for (const double rate : {1e3, 1e6, 2.5e7})
        for (const TimeNs most_lateness : {TimeNs(0), 5 * k_ms}) {
            CAPTURE(rate);
            CAPTURE(most_lateness);
            ChaosStream stream = made(1, {.bytes_per_second = rate});
            const auto size = std::size_t(std::min(rate, 4e6));
            ChaosDraws draws(9);
            const auto departures = run(stream, {{0, pattern(size, 2)}},
                                        [&] { return TimeNs(draws.next_unit() * double(most_lateness)); });

            const double depth = line_limit(rate).depth;
            for (std::size_t first = 0; first < departures.size(); ++first) {
                double sent = 0;
                for (std::size_t last = first; last < std::min(departures.size(), first + 400); ++last) {
                    sent += double(departures[last].bytes.size());
                    const double span = to_seconds(departures[last].at - departures[first].at);
                    REQUIRE(sent <= rate * span + depth + 1e-3);
                }
            }
            const double seconds = to_seconds(departures.back().at);
            CHECK(double(size) <= rate * seconds + depth + 1e-3);
            CHECK(double(size) >= 0.98 * rate * seconds);
        }
}

TEST_CASE("a rate that changes holds at once") {
    ChaosStream stream = made(1, {.bytes_per_second = 1e3});
    stream.push(as_bytes(pattern(100'000, 1)), 0);
    CHECK(take(stream, 0).size() == 10);  // The depth: what flows in 10 ms.
    CHECK(take(stream, k_second_ns).size() == 10);
    stream.set_faults({.bytes_per_second = 1e6}, k_second_ns);
    CHECK(take(stream, k_second_ns + 5 * k_ms).size() == 5'000);
    stream.set_faults({}, k_second_ns + 5 * k_ms);
    CHECK(take(stream, k_second_ns + 5 * k_ms).size() == 100'000 - 5'020);
}

TEST_CASE("flips: one bit of a byte, of a number that fits its binomial distribution, evenly spread") {
    // Six comparisons, which together fail a correct program with probability 0.001.
    const double threshold = testing::sidak_threshold(testing::k_significance, 6);
    const std::size_t size = testing::k_sanitized ? 1 << 20 : 1 << 22;
    const std::string sent = pattern(size, 4);
    for (const double p : {1e-3, 0.2}) {
        CAPTURE(p);
        ChaosStream stream = made(11, {.flip_probability = p});
        stream.push(as_bytes(sent), 0);
        const std::string received = take(stream, 0);
        REQUIRE(received.size() == size);

        double flips = 0;
        std::vector<double> per_bit(8), per_part(64);
        for (std::size_t i = 0; i < size; ++i) {
            const auto wrong = std::uint8_t(sent[i] ^ received[i]);
            if (wrong == 0) continue;
            REQUIRE(std::popcount(wrong) == 1);
            ++flips;
            ++per_bit[std::size_t(std::countr_zero(wrong))];
            ++per_part[i * 64 / size];
        }
        CHECK(double(stream.counts().flips) == flips);
        const double mean = double(size) * p, deviation = std::sqrt(double(size) * p * (1 - p));
        CHECK(testing::normal_two_sided_p((flips - mean) / deviation) > threshold);
        CHECK(testing::chi_square_test(per_bit, std::vector<double>(8, flips / 8)).p_value > threshold);
        // Within a part the count is binomial, with a variance smaller than Poisson's by 1 - p.
        double statistic = 0;
        for (const double count : per_part)
            statistic += (count - flips / 64) * (count - flips / 64) / (flips / 64 * (1 - p));
        CHECK(testing::chi_square_p_value(statistic, 63) > threshold);
    }
}

TEST_CASE("every byte is flipped with probability one, none with zero") {
    ChaosStream stream = made(1, {.flip_probability = 1});
    stream.push(as_bytes(std::string(1000, 'a')), 0);
    stream.set_faults({}, 0);
    stream.push(as_bytes(std::string(1000, 'a')), 0);
    const std::string received = take(stream, 0);
    CHECK(std::count(received.begin(), received.begin() + 1000, 'a') == 0);
    CHECK(std::count(received.begin() + 1000, received.end(), 'a') == 1000);
}

TEST_CASE("the same seed and chunks meet the same faults; flips do not depend on chunks") {
    const ChaosFaults faults{
        .delay = 5 * k_ms, .jitter = 5 * k_ms, .bytes_per_second = 1e6, .flip_probability = 1e-3};
    const auto arrivals = random_arrivals(300, 3000, k_ms, 8);
    const auto outcome = [&](std::uint64_t seed, const std::vector<Arrival>& what) {
        ChaosStream stream = made(seed, faults);
        return run(stream, what);
    };
    const auto first = outcome(42, arrivals);
    CHECK(first == outcome(42, arrivals));
    CHECK(joined(first) != joined(arrivals));
    CHECK(joined(first) != joined(outcome(43, arrivals)));
    CHECK(joined(first) == joined(outcome(42, {{0, joined(arrivals)}})));
}

TEST_CASE("a black hole lets nothing out, takes no more than fits, and forgets nothing") {
    ChaosStream stream = made(1, {.black_hole = true}, 1000);
    const std::string sent = pattern(1000, 1);
    stream.push(as_bytes(sent), 0);
    stream.end(0);
    CHECK(take(stream, 3600 * k_second_ns).empty());
    CHECK_FALSE(stream.next_due(0));
    CHECK_FALSE(stream.finished(3600 * k_second_ns));
    stream.set_faults({}, 3600 * k_second_ns);
    CHECK(stream.next_due(3600 * k_second_ns) == 3600 * k_second_ns);
    CHECK(take(stream, 3600 * k_second_ns) == sent);
    CHECK(stream.finished(3600 * k_second_ns));
}

TEST_CASE("no more is held than the capacity, nor more chunks than their limit") {
    ChaosStream stream = made(1, {.delay = k_second_ns, .jitter = k_second_ns}, 100'000);
    CHECK(stream.room() == 100'000);
    stream.push(as_bytes(std::string(60'000, 'a')), 0);
    CHECK(stream.room() == 40'000);
    stream.push(as_bytes(std::string(40'000, 'a')), 0);
    CHECK(stream.room() == 0);
    CHECK(take(stream, 2 * k_second_ns).size() == 100'000);
    CHECK(stream.room() == 100'000);
    CHECK(stream.counts().most_held_bytes == 100'000);

    TimeNs now = 2 * k_second_ns;
    stream.set_faults({.delay = k_second_ns}, now);
    std::size_t pushed = 0;
    for (; stream.room() > 0; ++pushed) stream.push(as_bytes("a"), now += k_ms);
    CHECK(pushed == ChaosStream::k_most_chunks);
    CHECK(take(stream, now + 2 * k_second_ns).size() == pushed);
}

TEST_CASE("bytes under way get through earlier when the delay falls, in order") {
    ChaosStream stream = made(1, {.delay = 3600 * k_second_ns});
    stream.push(as_bytes("early"), 0);
    stream.set_faults({.delay = 10 * k_ms}, k_second_ns);
    stream.push(as_bytes(" late"), k_second_ns + k_ms);
    CHECK(take(stream, k_second_ns + 10 * k_ms - 1).empty());
    CHECK(take(stream, k_second_ns + 10 * k_ms) == "early");
    CHECK(take(stream, k_second_ns + 11 * k_ms) == " late");
    stream.push(as_bytes("x"), 2 * k_second_ns);
    stream.end(2 * k_second_ns);
    stream.set_faults({}, 2 * k_second_ns);
    CHECK(take(stream, 2 * k_second_ns) == "x");
    CHECK(stream.finished(2 * k_second_ns));
}

TEST_CASE("the end follows the bytes with their delay, and what comes after it is dropped") {
    ChaosStream stream = made(1, {.delay = 10 * k_ms});
    stream.push(as_bytes("last words"), 0);
    stream.end(5 * k_ms);
    stream.push(as_bytes("ignored"), 6 * k_ms);
    stream.end(7 * k_ms);
    check_conservation(stream);
    CHECK(stream.counts().bytes_dropped == 7);
    CHECK(stream.next_due(6 * k_ms) == 10 * k_ms);
    CHECK(take(stream, 10 * k_ms) == "last words");
    CHECK_FALSE(stream.finished(15 * k_ms - 1));
    CHECK(stream.next_due(10 * k_ms) == 15 * k_ms);
    CHECK(stream.finished(15 * k_ms));
}

TEST_CASE("what is abandoned is counted as dropped") {
    ChaosStream stream = made(1, {.delay = 10 * k_ms});
    stream.push(as_bytes("lost"), 0);
    stream.abandon();
    check_conservation(stream);
    CHECK(stream.counts().bytes_dropped == 4);
    CHECK(stream.ready(k_second_ns).empty());
    CHECK_FALSE(stream.next_due(0));
}
