#pragma once
/// Same bits or not admitted: whether a server's pixels are those that its client would compute.
///
///     same bits   <=>   equal build and equal golden round
///
/// Why both: the golden round (render/golden_round.hpp) shows that two programs round differently, but not that they agree
/// in every scene; the build promises equal bits for equal work, but not on processors or libraries that differ. A server
/// of other bits is refused, or with `--relaxed` admitted: then the image is marked as not reproducible as soon as a round
/// of such a server is counted in it.
/// Thread safety: yes.   Test: tests/session/test_admission.cpp

#include <optional>
#include <string>

#include "pathscope/core/hash.hpp"
#include "pathscope/protocol/message.hpp"

namespace pathscope {

/// What HELLO says of a program's floats.
struct BitsIdentity {
    std::string build;  ///< build_identity()
    Digest golden{};    ///< golden_hash(); zeros say nothing.
};

/// Of this program. The first call renders the golden round, some milliseconds: not on a thread that owes heartbeats.
[[nodiscard]] const BitsIdentity& own_bits();

/// Why a server's bits are not, or may not be, the client's.
struct BitsMisfit {
    RejectCode code = RejectCode::bits;
    std::string what;    ///< For the users of both sides.
    std::string remedy;  ///< What to do, if it is refused.
};
[[nodiscard]] std::optional<BitsMisfit> bits_misfit(const BitsIdentity& client, const BitsIdentity& server);

/// What to answer to the HELLO of a server of such bits; nothing if it may take part. relaxed: bits may differ.
/// same_before: whether they were the client's by an earlier HELLO of this very server, whose program is the same still.
[[nodiscard]] std::optional<message::Reject> reject_bits(const std::optional<BitsMisfit>& misfit,
                                                         bool relaxed,
                                                         std::optional<bool> same_before = std::nullopt);

}  // namespace pathscope
