#include "pathscope/integrator/settings.hpp"

#include <set>

#include "testing.hpp"

using namespace pathscope;

namespace {
template <class E>
void check_table() {
    std::set<std::string_view> names;
    for (const auto& [value, name] : enum_table(E{})) {
        CHECK(from_name<E>(name) == value);
        CHECK(name_of(value) == name);
        CHECK(names.insert(name).second);
    }
}
}  // namespace

TEST_CASE("every lever has one name for each of its positions") {
    check_table<Setting>();
    check_table<Roulette>();
    check_table<LightSampling>();
    check_table<HemisphereSampling>();
    check_table<MisHeuristic>();
    check_table<SamplerKind>();
}

TEST_CASE("textbook and best differ in every lever") {
    const TransportSettings best = make_settings(Setting::best), textbook = make_settings(Setting::textbook);
    CHECK(best.light != textbook.light);
    CHECK(best.light_samples != textbook.light_samples);
    CHECK(best.hemisphere != textbook.hemisphere);
    CHECK(best.mis != textbook.mis);
    CHECK(best.sampler != textbook.sampler);
    CHECK(best.roulette.kind != textbook.roulette.kind);
}
