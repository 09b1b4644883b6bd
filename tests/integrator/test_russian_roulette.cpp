#include "pathscope/integrator/russian_roulette.hpp"

#include <cmath>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("E[roulette] = 1: survivors carry the weight of the dead, for every kind and throughput") {
    const int n = 200'000;
    for (const Roulette kind : {Roulette::constant, Roulette::throughput})
        for (const float throughput : {0.05f, 0.3f, 0.9f, 1.0f, 7.0f}) {
            RouletteParams params;
            params.kind = kind;
            HashRng rng(17);
            double sum = 0;
            for (int i = 0; i < n; ++i)
                sum +=
                    roulette_weight(throughput, params.first_bounce, rng.next_float(), params).value_or(0.0f);
            // A survivor weighs 1/q with probability q: the variance is 1/q - 1. Five standard errors.
            const double q = kind == Roulette::constant ? params.constant_survival
                                                        : std::min(throughput, params.max_survival);
            CHECK(std::abs(sum / n - 1) < 5 * std::sqrt((1 / q - 1) / n) + 1e-6);
        }
}

TEST_CASE("bounces before the first never die, black paths die at once") {
    CHECK(roulette_weight(0.0f, 2, 0.999f) == 1.0f);
    CHECK_FALSE(roulette_weight(0.0f, 3, 0.0f).has_value());
    CHECK_FALSE(roulette_weight(100.0f, 3, 0.96f).has_value());
}
