#pragma once
/// Fuzz targets: each makes something of any bytes, and must neither crash, nor leak, nor break its own promise.
///
///     // fuzz_codec.cpp
///     void unpack_anything(std::string_view bytes) { ... CHECK(...) ... }
///     std::vector<std::string> seeds() { return {...}; }
///     const FuzzTarget k_target{"codec", unpack_anything, seeds};
///
/// Why a list of targets and not one LLVMFuzzerTestOneInput each: so that the same file is a program of libFuzzer
/// (libfuzzer.cpp), a part of test_fuzz, which runs what was kept in tests/fuzz/corpus/NAME/ in every build, and a part of
/// fuzz_seeds, which writes what the fuzzer begins with.
/// What must hold is CHECKed: a failed CHECK is a finding like any other.
/// Requires: a target does the same for the same bytes, whatever it was given before.
/// How to run and to add one: docs/fuzzing.md

#include <string>
#include <string_view>
#include <vector>

namespace pathscope::fuzz {

struct FuzzTarget;

/// All targets of this program. A function, since they enlist themselves before main().
inline std::vector<const FuzzTarget*>& all_targets() {
    static std::vector<const FuzzTarget*> targets;
    return targets;
}

struct FuzzTarget {
    FuzzTarget(std::string_view its_name, void (*its_run)(std::string_view),
               std::vector<std::string> (*its_seeds)())
        : name(its_name), run(its_run), seeds(its_seeds) {
        all_targets().push_back(this);
    }
    FuzzTarget(const FuzzTarget&) = delete;
    FuzzTarget& operator=(const FuzzTarget&) = delete;

    std::string_view name;
    void (*run)(std::string_view bytes);
    std::vector<std::string> (*seeds)();  ///< Inputs that reach far, made of what the project itself writes.
};

}  // namespace pathscope::fuzz
