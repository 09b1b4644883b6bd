#include "pathscope/probe/latency_histogram.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("an empty histogram knows nothing") {
    const LatencyHistogram histogram;
    CHECK(histogram.count() == 0);
    CHECK_FALSE(histogram.quantile(0.5).has_value());
    CHECK_FALSE(histogram.mean().has_value());
    CHECK_FALSE(histogram.largest().has_value());
}

TEST_CASE("one value is every quantile, exactly") {
    for (const TimeNs value :
         {TimeNs{0}, TimeNs{17}, TimeNs{1023}, TimeNs{1024}, k_millisecond_ns, 100 * k_second_ns}) {
        LatencyHistogram histogram;
        histogram.add(value);
        for (const double q : {0.0, 0.5, 1.0}) CHECK(*histogram.quantile(q) == value);
    }
}

TEST_CASE("quantiles of a million-fold range are within the stated error of the sorted list") {
    HashRng rng(11);
    LatencyHistogram histogram;
    std::vector<TimeNs> values;
    double sum = 0;
    for (int i = 0; i < 20000; ++i) {
        const auto value =
            static_cast<TimeNs>(2000.0 * std::pow(10.0, 6.0 * rng.next_float()));  // 2 us .. 2000 s
        values.push_back(std::min(value, 60 * k_second_ns));
        sum += static_cast<double>(values.back());
        histogram.add(values.back());
    }
    std::sort(values.begin(), values.end());
    for (const double q : {0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99, 0.999}) {
        const auto rank = static_cast<std::size_t>(std::ceil(q * 20000.0)) - 1;
        const auto exact = static_cast<double>(values[rank]);
        CHECK(std::abs(static_cast<double>(*histogram.quantile(q)) - exact) <=
              LatencyHistogram::k_relative_error * exact);
    }
    CHECK(*histogram.largest() == values.back());
    CHECK(*histogram.mean() == static_cast<TimeNs>(sum) / 20000);
}

TEST_CASE("the ends of the range hold what lies beyond them") {
    LatencyHistogram histogram;
    for (int i = 0; i < 10; ++i) histogram.add(5);
    for (int i = 0; i < 10; ++i) histogram.add(1000 * k_second_ns);
    CHECK(*histogram.quantile(0.5) <= 1100);
    CHECK(*histogram.quantile(0.51) >= 64 * k_second_ns);
    CHECK(*histogram.quantile(1.0) <= 1000 * k_second_ns);
}
