#include "pathscope/session/door.hpp"

#include <sys/stat.h>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/key_file.hpp"
#include "pathscope/net/poller.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr TimeNs k_patience = 10 * k_second_ns;

/// The sockets behind a door, as a client session holds them.
struct House {
    Context context;
    Door door;
    PublisherSocket input;
    RouterSocket monitor, frames;

    explicit House(const ClientConfig& config)
        : door(std::move(*Door::open(context, config))),
          input(
              std::move(*PublisherSocket::bind(context, "tcp://127.0.0.1:*", door.options(Channel::input)))),
          monitor(
              std::move(*RouterSocket::bind(context, "tcp://127.0.0.1:*", door.options(Channel::monitor)))),
          frames(
              std::move(*RouterSocket::bind(context, "tcp://127.0.0.1:*", door.options(Channel::frames)))) {
        REQUIRE(bool(door.watch(input, monitor, frames)));
    }

    /// Steps until it has heard from a dialler with that security, or turned it away. True if it was heard.
    bool hears(const Security& security) {
        SocketOptions options;
        options.security = security;
        auto dealer = DealerSocket::connect(context, monitor.endpoint(), random_routing_id(), options);
        const TimeNs limit = monotonic_now() + k_patience;
        bool sent = false;
        for (std::uint64_t refused = 0; refused == 0;) {
            REQUIRE(monotonic_now() < limit);
            sent = sent || dealer->send({"x"}) == SendOutcome::delivered;
            (void)wait_readable({monitor.pollable()}, 2 * k_millisecond_ns);
            if (monitor.receive()) return true;
            refused = door.step(monotonic_now(), input).refused;
        }
        return false;
    }
};

ClientConfig with_keys(const KeyPair& keys, const std::filesystem::path& list) {
    ClientConfig config;
    config.keys = ClientKeys{keys, list};
    return config;
}

}  // namespace

TEST_CASE("without keys a client listens on this machine only, unless its user insists") {
    ClientConfig config;
    CHECK(bool(check_listening(config)));
    config.host = "0.0.0.0";
    REQUIRE_FALSE(bool(check_listening(config)));
    CHECK(check_listening(config).error().message.find("--insecure") != std::string::npos);
    CHECK_FALSE(bool(Door::open(Context(), config)));
    LogCapture log;
    config.insecure = true;
    CHECK(bool(Door::open(Context(), config)));
    CHECK(log.count("Insecure") > 0);

    config.insecure = false;
    config.keys = ClientKeys{make_key_pair(), {}};
    CHECK(bool(check_listening(config)));
    CHECK(std::holds_alternative<Listener>(Door::open(Context(), config)->options(Channel::frames).security));
}

TEST_CASE("local servers get a key each, in a private file that goes with the door") {
    std::filesystem::path file;
    {
        ClientConfig config = with_keys(make_key_pair(), {});
        config.local_servers = 2;
        House house(config);
        const auto first = house.door.arguments_of_local_server(0),
                   second = house.door.arguments_of_local_server(1);
        REQUIRE(first.size() == 4);
        CHECK(first[0] == "--key");
        CHECK(first[1] != second[1]);
        CHECK(first[3] == config.keys->pair.public_key);
        file = first[1];
        struct stat status {};
        REQUIRE(::stat(file.parent_path().c_str(), &status) == 0);
        CHECK((status.st_mode & 07777) == 0700);
        const auto keys = read_secret_key_file(file);
        REQUIRE(bool(keys));
        for (const std::string& argument : first) CHECK(argument != keys->secret_key);
        CHECK(house.hears(Dialler{*keys, config.keys->pair.public_key}));
        LogCapture log;
        CHECK_FALSE(house.hears(Dialler{make_key_pair(), config.keys->pair.public_key}));
    }
    CHECK_FALSE(std::filesystem::exists(file.parent_path()));
    CHECK(Door::open(Context(), ClientConfig{})->arguments_of_local_server(0).empty());
}

TEST_CASE("who is turned away is counted and told, and the list holds as soon as it is written") {
    const testing::TemporaryFolder folder;
    const std::filesystem::path list = folder.path() / "allow";
    const KeyPair client = make_key_pair(), server = make_key_pair(), late = make_key_pair();
    REQUIRE(bool(write_file_atomically(list, server.public_key + "\n")));
    House house(with_keys(client, list));
    LogCapture log;
    CHECK(house.hears(Dialler{server, client.public_key}));
    CHECK_FALSE(house.hears(Dialler{late, client.public_key}));
    // ZAP tells of it on a thread of its own.
    for (const TimeNs limit = monotonic_now() + k_patience;
         log.count(late.public_key) == 0 && monotonic_now() < limit;)
        (void)house.door.step(monotonic_now(), house.input);
    CHECK(log.count(late.public_key) > 0);
    CHECK_FALSE(house.hears({}));

    REQUIRE(bool(write_file_atomically(list, late.public_key + "\n")));
    TimeNs now = monotonic_now();
    for (int i = 0; i < 3; ++i) (void)house.door.step(now += AllowList::k_look, house.input);
    CHECK(log.count("it has 1 key.") > 0);
    CHECK(house.hears(Dialler{late, client.public_key}));
    CHECK_FALSE(house.hears(Dialler{server, client.public_key}));

    REQUIRE(bool(write_file_atomically(list, "nonsense\n")));
    CHECK_FALSE(bool(Door::open(Context(), with_keys(client, list))));
    CHECK_FALSE(bool(Door::open(Context(), with_keys(client, folder.path() / "none"))));
}
