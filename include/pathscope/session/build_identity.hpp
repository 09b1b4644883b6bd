#pragma once
/// Which program this is: equal identities promise equal bits for equal work.

#include <string>

namespace pathscope {

/// "0.1.0": for people.
[[nodiscard]] std::string program_version();

/// Version, compiler, target and what the compiler was told about floats: HELLO's field `build`, at most 64 bytes.
[[nodiscard]] std::string build_identity();

}  // namespace pathscope
