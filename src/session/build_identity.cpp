#include "pathscope/session/build_identity.hpp"

#include <fmt/format.h>

#include "pathscope/core/hash.hpp"

#ifndef PATHSCOPE_VERSION
#error "PATHSCOPE_VERSION is set by CMakeLists.txt"
#endif

namespace pathscope {

std::string program_version() { return PATHSCOPE_VERSION; }

std::string build_identity() {
#ifdef __OPTIMIZE__
    constexpr const char* k_optimised = "optimised";
#else
    constexpr const char* k_optimised = "plain";
#endif
#if defined(__x86_64__)
    constexpr const char* k_target = "x86-64-v2";
#elif defined(__aarch64__)
    constexpr const char* k_target = "aarch64";
#else
    constexpr const char* k_target = "other";
#endif
    const std::string compiler = to_hex(hash_text(__VERSION__)).substr(0, 8);
    return fmt::format("{} {} {} {}", PATHSCOPE_VERSION, k_target, k_optimised, compiler);
}

}  // namespace pathscope
