/// Every target over its seeds and over what was kept of earlier runs: what was found once stays mended, in each build.

#include <algorithm>
#include <filesystem>

#include "fuzz_target.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr const char* k_corpus = "tests/fuzz/corpus";

std::vector<std::filesystem::path> kept_inputs(std::string_view target) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(k_corpus) / target))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace

TEST_CASE("every target lives through its seeds and through its kept corpus") {
    const ScopedLogSink quiet([](LogLevel, std::string_view) {});
    for (const fuzz::FuzzTarget* target : fuzz::all_targets()) {
        CAPTURE(target->name);
        const auto seeds = target->seeds();
        CHECK_FALSE(seeds.empty());
        for (const std::string& seed : seeds) target->run(seed);
        const auto files = kept_inputs(target->name);
        CHECK_MESSAGE(!files.empty(), "tools/fuzz --corpus makes one");
        CHECK_MESSAGE(files.size() <= 110, "the corpus is kept small: tools/fuzz --corpus");
        for (const auto& file : files) {
            const auto bytes = read_file(file);
            REQUIRE(bool(bytes));
            CHECK(bytes->size() <= 4096);
            target->run(*bytes);
        }
        target->run("");
    }
}

TEST_CASE("each folder of the corpus belongs to a target") {
    for (const auto& entry : std::filesystem::directory_iterator(k_corpus)) {
        const std::string name = entry.path().filename().string();
        CHECK_MESSAGE(std::any_of(fuzz::all_targets().begin(), fuzz::all_targets().end(),
                                  [&](const fuzz::FuzzTarget* target) { return target->name == name; }),
                      name);
    }
}
