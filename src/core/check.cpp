#include "pathscope/core/check.hpp"

#include <cstdio>
#include <cstdlib>

namespace pathscope {

void check_failed(const char* condition, const char* file, int line, const std::string& values) {
    std::fprintf(stderr, "bug: %s:%d: CHECK(%s) failed%s%s\n", file, line, condition,
                 values.empty() ? "" : ": ", values.c_str());
    std::abort();
}

}  // namespace pathscope
