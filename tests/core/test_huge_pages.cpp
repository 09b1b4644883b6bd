#include "pathscope/core/huge_pages.hpp"

#include <cstdint>

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("tables of any size can be written and read, and large ones begin on a page") {
    struct alignas(64) Line {
        int value = 0;
    };
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{1000}, std::size_t{40000}}) {
        HugePageVector<Line> lines(count);
        for (std::size_t i = 0; i < count; ++i) lines[i].value = int(i);
        for (std::size_t i = 0; i < count; ++i) REQUIRE(lines[i].value == int(i));
        if (count > 0) CHECK(reinterpret_cast<std::uintptr_t>(lines.data()) % alignof(Line) == 0);
        if (count == 40000) CHECK(reinterpret_cast<std::uintptr_t>(lines.data()) % (2 << 20) == 0);
        const HugePageVector<Line> copy = lines;
        CHECK(copy.size() == count);
    }
}
