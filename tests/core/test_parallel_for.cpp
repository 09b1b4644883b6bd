#include "pathscope/core/parallel_for.hpp"

#include <thread>
#include <vector>

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("parallel_for runs each index once, for any team and grain") {
    for (const int threads : {0, 1, 2, 7})
        for (const int grain : {1, 3, 1000}) {
            std::vector<int> visits(517, 0);
            parallel_for(
                std::int64_t(visits.size()), threads, [&](int i) { ++visits[std::size_t(i)]; }, grain);
            CHECK(visits == std::vector<int>(517, 1));
        }
    parallel_for(0, 4, [](int) { FAIL("no index to run"); });
}

TEST_CASE("parallel_for may be called from several threads at once") {
    std::vector<long> sums(4, 0);
    std::vector<std::thread> callers;
    for (long& sum : sums)
        callers.emplace_back([&sum] {
            std::vector<long> squares(1000);
            parallel_for(1000, 2, [&](int i) { squares[std::size_t(i)] = long(i) * i; });
            for (const long square : squares) sum += square;
        });
    for (std::thread& caller : callers) caller.join();
    CHECK(sums == std::vector<long>(4, 332833500L));
}
