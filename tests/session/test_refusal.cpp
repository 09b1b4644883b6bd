#include "pathscope/session/refusal.hpp"

#include <fmt/format.h>

#include <set>

#include "testing.hpp"

using namespace pathscope;

namespace {

bool has(const std::string& sentence, const std::string& part) {
    return sentence.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE(
    "every reason is a sentence of its own that says what to do, on both sides, with keys and without") {
    const KeyPair own = make_key_pair(), other = make_key_pair();
    const Security keys = Dialler{own, other.public_key};
    std::set<std::string> at_client;
    for (const auto& [reason, name] : k_refusal_reason_names) {
        CAPTURE(name);
        for (const Security& security : {Security{}, keys}) {
            const std::string sentence = refusal_at_server(reason, "tcp://10.0.0.1:5556", security);
            CHECK(has(sentence, "The client at tcp://10.0.0.1:5556 refuses this server: "));
            CHECK(sentence.size() > 60);
            CHECK_FALSE(has(sentence, own.secret_key));
        }
        CHECK(at_client.insert(refusal_at_client({reason, "10.0.0.7"}, own.public_key)).second);
        CHECK(has(refusal_at_client({reason, "10.0.0.7"}, ""), "10.0.0.7"));
        CHECK(has(refusal_at_client({reason, ""}, ""), "Refused a connection: "));
    }
    // What the other side's user has to type is in the sentence.
    CHECK(has(refusal_at_server(RefusalReason::unlisted_key, "x", keys), own.public_key));
    CHECK(has(refusal_at_server(RefusalReason::broke_off, "x", keys), "--server-key"));
    CHECK(has(refusal_at_server(RefusalReason::one_sided, "x", keys), "Start it with --key"));
    CHECK(has(refusal_at_server(RefusalReason::one_sided, "x", {}), "Start this server with --key"));
    CHECK(has(refusal_at_client({RefusalReason::wrong_key, ""}, own.public_key), own.public_key));
    CHECK(has(refusal_at_client(RefusedKey{other.public_key, "10.0.0.7"}), other.public_key));
}

TEST_CASE("a sentence is said once a minute, and then how often it was true") {
    SaidOnce said;
    TimeNs now = 7 * k_second_ns;
    CHECK(said.say("a", now) == "a");
    CHECK_FALSE(said.say("a", now + k_second_ns));
    CHECK_FALSE(said.say("a", now + SaidOnce::k_pause - 1));
    CHECK(said.say("b", now + 1) == "b");
    now += SaidOnce::k_pause;
    CHECK(said.say("a", now) == "a (2 times more since.)");
    now += SaidOnce::k_pause;
    CHECK(said.say("a", now) == "a");
}

TEST_CASE("a thousand different sentences are not all said") {
    SaidOnce said;
    std::size_t count = 0;
    for (int i = 0; i < 1'000; ++i) count += said.say(fmt::format("{}", i), i).has_value();
    CHECK(count == SaidOnce::k_max_sentences);
    CHECK(said.say("later", SaidOnce::k_pause + 2'000));
}

TEST_CASE("a refused server waits 250 ms, then twice as long, up to 5 s; a welcome begins anew") {
    Redial redial;
    const Security none;
    TimeNs now = 100 * k_second_ns;
    CHECK(redial.next() < now);
    for (const int ms : {250, 500, 1000, 2000, 4000, 5000, 5000}) {
        (void)redial.on_refused(RefusalReason::one_sided, "x", none, now);
        CHECK(redial.next() - now == ms * k_millisecond_ns);
        now = redial.next();
    }
    redial.on_welcome();
    (void)redial.on_refused(RefusalReason::one_sided, "x", none, now);
    CHECK(redial.next() - now == Redial::k_first_pause);
}

TEST_CASE("a line that broke off is told from the second time on, other reasons at once") {
    Redial redial;
    const Security none;
    CHECK_FALSE(redial.on_refused(RefusalReason::broke_off, "x", none, 1));
    CHECK(redial.on_refused(RefusalReason::one_sided, "x", none, 2));
    CHECK_FALSE(redial.on_refused(RefusalReason::broke_off, "x", none, 3));
    CHECK(redial.on_refused(RefusalReason::broke_off, "x", none, 4));
    CHECK_FALSE(redial.on_refused(RefusalReason::broke_off, "x", none, 5));  // Said.
}
