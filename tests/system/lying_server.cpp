/// The render server with one fault: one bit of one result in nine is false. For test_audit.py alone.
///
/// This program is pathscope-server's and a copy of server_work.cpp, compiled with put_block_result renamed to the
/// function below, so that everything else of it is sound: the sizes, the hash, the time it takes.

#undef put_block_result

#include <vector>

#include "pathscope/protocol/block_result.hpp"

namespace pathscope {

void put_false_result(message::Tile& tile, std::span<const PixelSum> sums, WireFormat format) {
    std::vector<PixelSum> told(sums.begin(), sums.end());
    if ((tile.unit + tile.first) % 9 == 4) told.front().g ^= 1;
    put_block_result(tile, told, format);
}

}  // namespace pathscope
