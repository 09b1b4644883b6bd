#include "pathscope/session/admission.hpp"

#include <fmt/format.h>

#include "pathscope/render/golden_round.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

/// Enough to tell two apart.
std::string short_hex(const Digest& digest) { return to_hex(digest).substr(0, 8); }

}  // namespace

const BitsIdentity& own_bits() {
    static const BitsIdentity bits{build_identity(), golden_hash()};
    return bits;
}

std::optional<BitsMisfit> bits_misfit(const BitsIdentity& client, const BitsIdentity& server) {
    constexpr const char* k_same_build = "Run the same build on both, or give the client --relaxed.";
    const bool same_build = server.build == client.build;
    if (server.golden == client.golden) {
        if (same_build) return std::nullopt;
        return BitsMisfit{
            RejectCode::build,
            fmt::format("This server is '{}', the client '{}'; their golden rounds agree, other "
                        "scenes may not.",
                        server.build, client.build),
            k_same_build};
    }
    if (server.golden == Digest{})
        return BitsMisfit{RejectCode::bits, "This server does not say what bits its golden round has.",
                          k_same_build};
    if (!same_build)
        return BitsMisfit{RejectCode::bits,
                          fmt::format("This server is '{}', the client '{}', and their golden rounds differ.",
                                      server.build, client.build),
                          k_same_build};
    return BitsMisfit{
        RejectCode::bits,
        fmt::format("This server's golden round has the bits {}, the client's {}, though it is the same "
                    "build: its processor or libraries round otherwise.",
                    short_hex(server.golden), short_hex(client.golden)),
        "Use a machine like the client's, or give the client --relaxed."};
}

std::optional<message::Reject> reject_bits(const std::optional<BitsMisfit>& misfit, bool relaxed,
                                           std::optional<bool> same_before) {
    if (misfit && !relaxed)
        return message::Reject{misfit->code, fmt::format("{} {}", misfit->what, misfit->remedy), 0};
    if (same_before && *same_before != !misfit)
        return message::Reject{RejectCode::malformed, "HELLO says other bits than it said before.", 0};
    return std::nullopt;
}

}  // namespace pathscope
