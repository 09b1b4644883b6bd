#pragma once
/// What a server that neither fails nor lies answers to a lease: light that everybody can work out (simulated_renderer.hpp).
/// For scripts that play servers.

#include "../session/simulated_renderer.hpp"
#include "pathscope/protocol/block_result.hpp"

namespace pathscope::fuzz {

[[nodiscard]] inline message::Tile honest_tile(const message::Lease& lease, std::uint32_t seed,
                                               WireFormat wire) {
    RoundJob job;
    job.round = {lease.unit, lease.rect, lease.first, lease.count};
    job.settings.seed = seed;
    const RoundResult result = testing::render_by_hash(job, LightPart::indirect);
    message::Tile tile = message::make_tile(lease);
    tile.rays = result.rays;
    tile.samples = result.samples;
    tile.render_ns = k_millisecond_ns;
    put_block_result(tile, result.sums, wire);
    return tile;
}

}  // namespace pathscope::fuzz
