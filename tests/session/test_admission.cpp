#include "pathscope/session/admission.hpp"

#include "pathscope/render/golden_round.hpp"
#include "pathscope/session/build_identity.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

Digest digest_of(char byte) { return hash_text(std::string(1, byte)); }

}  // namespace

TEST_CASE("equal build and equal golden round are the same bits; anything else is refused for what differs") {
    const BitsIdentity client{"a build", digest_of('a')};
    CHECK(!bits_misfit(client, client));
    struct Case {
        BitsIdentity server;
        RejectCode code;
        const char* names;
    };
    for (const Case& c : {Case{{"b build", digest_of('a')}, RejectCode::build, "golden rounds agree"},
                          Case{{"a build", digest_of('b')}, RejectCode::bits, "the same build"},
                          Case{{"b build", digest_of('b')}, RejectCode::bits, "golden rounds differ"},
                          Case{{"b build", Digest{}}, RejectCode::bits, "does not say"}}) {
        CAPTURE(c.names);
        const auto misfit = bits_misfit(client, c.server);
        REQUIRE(misfit);
        CHECK(misfit->code == c.code);
        CHECK(misfit->what.find(c.names) != std::string::npos);
        CHECK(misfit->remedy.find("--relaxed") != std::string::npos);
        CHECK(misfit->what.size() + 1 + misfit->remedy.size() <= 256);  // What REJECT carries.
    }
}

TEST_CASE("a program says its build and its golden round") {
    CHECK(own_bits().build == build_identity());
    CHECK(own_bits().golden == golden_hash());
    CHECK(!bits_misfit(own_bits(), own_bits()));
    const auto misfit = bits_misfit(own_bits(), {"0.1.0 aarch64 optimised 12345678", digest_of('a')});
    REQUIRE(misfit);
    CHECK(misfit->what.size() + 1 + misfit->remedy.size() <= 256);
}
