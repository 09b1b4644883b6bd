#include "pathscope/sampling/mis.hpp"

#include <limits>

#include "testing.hpp"

using namespace pathscope;

namespace {
constexpr float k_inf = std::numeric_limits<float>::infinity();
}

TEST_CASE("heuristic names go both ways") {
    for (const auto& entry : k_mis_names) CHECK(from_name<MisHeuristic>(name_of(entry.value)) == entry.value);
}

TEST_CASE("the weights of the two techniques sum to 1, over all magnitudes") {
    const float pdfs[] = {0, 1e-45f, 1e-38f, 1e-20f, 1e-3f, 0.5f, 1, 3, 1e10f, 1e30f, 3e38f, k_inf};
    for (const MisHeuristic heuristic : {MisHeuristic::balance, MisHeuristic::power})
        for (const float a : pdfs)
            for (const float b : pdfs) {
                if (a == 0 && b == 0) continue;
                const float wa = mis_weight(heuristic, a, b), wb = mis_weight(heuristic, b, a);
                CAPTURE(a);
                CAPTURE(b);
                CHECK(wa >= 0);
                CHECK(wa <= 1);
                CHECK(std::abs(wa + wb - 1) < 1e-6f);
            }
}

TEST_CASE("weights by hand") {
    CHECK(mis_weight(MisHeuristic::balance, 3, 1) == 0.75f);
    CHECK(mis_weight(MisHeuristic::power, 3, 1) == 0.9f);
    CHECK(mis_weight(MisHeuristic::off, 3, 1) == 1);
    // One technique cannot draw it: the other has it all, and an undrawn sample has nothing.
    for (const auto& entry : k_mis_names) {
        CHECK(mis_weight(entry.value, 2, 0) == 1);
        CHECK(mis_weight(entry.value, 0, 2) == 0);
        CHECK(mis_weight(entry.value, 0, 0) == 0);
        CHECK(mis_weight(entry.value, k_inf, 1) == 1);
    }
    CHECK(mis_weight(MisHeuristic::balance, 1, k_inf) == 0);
    CHECK(mis_weight(MisHeuristic::power, k_inf, k_inf) == 0.5f);
    CHECK_FALSE(uses_both_techniques(MisHeuristic::off));
    CHECK(uses_both_techniques(MisHeuristic::balance));
}
