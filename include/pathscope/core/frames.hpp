#pragma once
/// Frames: the bytes of one multipart message, as `protocol` makes them and `net` moves them.
///
/// Why here: neither of the two modules may include the other. Why std::string: it owns its bytes, moves
/// without copying, and needs no conversion on either side.

#include <string>
#include <vector>

namespace pathscope {

using Frames = std::vector<std::string>;

}  // namespace pathscope
