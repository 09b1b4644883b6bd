/// The one target of this program, as libFuzzer calls it.

#include <cstddef>
#include <cstdint>

#include "fuzz_target.hpp"
#include "pathscope/core/log.hpp"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
    pathscope::set_log_sink([](pathscope::LogLevel, std::string_view) {});
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    pathscope::fuzz::all_targets().front()->run({reinterpret_cast<const char*>(data), size});
    return 0;
}
