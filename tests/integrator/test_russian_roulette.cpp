#include "pathscope/integrator/russian_roulette.hpp"

#include <cmath>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {
RouletteParams of_kind(Roulette kind) {
    RouletteParams params;
    params.kind = kind;
    return params;
}
}  // namespace

TEST_CASE("E[roulette] = 1: survivors carry the weight of the dead, for every kind, throughput and bounce") {
    const int n = 200'000;
    for (const auto& [kind, name] : k_roulette_names)
        for (const float throughput : {0.05f, 0.3f, 0.9f, 1.0f, 7.0f})
            for (const int bounce : {0, 3, 40}) {
                CAPTURE(name);
                const RouletteParams params = of_kind(kind);
                HashRng rng(17);
                double sum = 0;
                const PathStrength path{throughput, 0.5f};
                for (int i = 0; i < n; ++i)
                    sum += roulette_weight(
                               path, bounce, [&] { return rng.next_float(); }, params)
                               .value_or(0.0f);
                // A survivor weighs 1/q with probability q: the variance is 1/q - 1. Five standard errors.
                const double q = survival_probability(path, bounce, params);
                CHECK(std::abs(sum / n - 1) < 5 * std::sqrt((1 / q - 1) / n) + 1e-6);
            }
}

TEST_CASE("the probabilities are those of the header") {
    const RouletteParams constant = of_kind(Roulette::constant), throughput = of_kind(Roulette::throughput),
                         efficiency = of_kind(Roulette::efficiency);
    CHECK(survival_probability({0.5f}, 3, constant) == constant.constant_survival);
    CHECK(survival_probability({0.5f, 0.1f}, 3, throughput) == 0.5f);
    CHECK(survival_probability({7.0f}, 3, throughput) == throughput.max_survival);
    CHECK(survival_probability({0.375f}, 0, efficiency) == 0.75f);
    CHECK(survival_probability({0.03f, 0.08f}, 9, efficiency) == doctest::Approx(0.75f));
    CHECK(survival_probability({0.1f, 0.1f}, 2, efficiency) == 1);
    CHECK(survival_probability({0.1f, 0.1f}, 3, efficiency) == efficiency.max_survival);
}

TEST_CASE("bounces before the first never die, black paths die at once, and none lives for ever") {
    for (const Roulette kind : {Roulette::constant, Roulette::throughput})
        CHECK(roulette_weight(
                  {0.0f}, 2, [] { return 0.999f; }, of_kind(kind)) == 1.0f);
    for (const Roulette kind : {Roulette::throughput, Roulette::efficiency}) {
        CHECK_FALSE(roulette_weight(
                        {0.0f}, 3, [] { return 0.0f; }, of_kind(kind))
                        .has_value());
        CHECK_FALSE(roulette_weight(
                        {100.0f}, 3, [] { return 0.96f; }, of_kind(kind))
                        .has_value());
    }
    CHECK_FALSE(roulette_weight(
                    {0.0f}, 0, [] { return 0.0f; }, of_kind(Roulette::efficiency))
                    .has_value());
}
