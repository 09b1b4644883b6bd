#include "pathscope/net/chaos_relay.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "net_testing.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/router.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr TimeNs k_ms = k_millisecond_ns;
constexpr int k_socket_bytes =
    64 << 10;  ///< Of the kernel's memory, for each socket of the tests and direction.

/// A plain TCP socket of the tests. It does not block; what must come is waited for with a time limit.
class Plain {
  public:
    Plain() : Plain(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0)) {
        for (const int buffer : {SO_SNDBUF, SO_RCVBUF})
            ::setsockopt(number_, SOL_SOCKET, buffer, &k_socket_bytes, sizeof k_socket_bytes);
    }
    explicit Plain(int number) : number_(number) {}
    Plain(Plain&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    ~Plain() { close(); }

    static Plain listening() {
        Plain socket;
        sockaddr_in address = loopback(0);
        REQUIRE(::bind(socket.number_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
        REQUIRE(::listen(socket.number_, 64) == 0);
        return socket;
    }
    static Plain dialled(int port) {
        Plain socket;
        sockaddr_in address = loopback(port);
        const int status = ::connect(socket.number_, reinterpret_cast<sockaddr*>(&address), sizeof address);
        REQUIRE((status == 0 || errno == EINPROGRESS));
        return socket;
    }
    int port() const {
        sockaddr_in address{};
        socklen_t size = sizeof address;
        REQUIRE(::getsockname(number_, reinterpret_cast<sockaddr*>(&address), &size) == 0);
        return ntohs(address.sin_port);
    }
    Plain accepted() const {
        REQUIRE(wait(POLLIN));
        return Plain(::accept4(number_, nullptr, nullptr, SOCK_NONBLOCK));
    }

    bool wait(short events, TimeNs timeout = testing::k_patience) const {
        pollfd poll{number_, events, 0};
        return ::poll(&poll, 1, int(timeout / k_ms)) == 1;
    }
    /// As many bytes as the socket takes now.
    std::size_t send_some(std::string_view bytes) const {
        const ssize_t sent = ::send(number_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        return sent > 0 ? std::size_t(sent) : 0;
    }
    void send_all(std::string_view bytes) const {
        while (!bytes.empty()) {
            if (!wait(POLLOUT)) return;  // What is missing will be missed at the other end.
            bytes.remove_prefix(send_some(bytes));
        }
    }
    /// So many bytes, or fewer if the stream ends before.
    std::string receive(std::size_t count) const {
        std::string all;
        while (all.size() < count && wait(POLLIN)) {
            std::string part(std::min<std::size_t>(count - all.size(), 1 << 16), '\0');
            const ssize_t got = ::recv(number_, part.data(), part.size(), 0);
            if (got <= 0) break;
            all.append(part, 0, std::size_t(got));
        }
        return all;
    }
    /// 0: an end of stream came; an errno: that came instead; -1: nothing came, or bytes did.
    int ending() const {
        char byte;
        if (!wait(POLLIN)) return -1;
        const ssize_t got = ::recv(number_, &byte, 1, 0);
        return got == 0 ? 0 : got < 0 ? errno : -1;
    }
    void end_sending() const { ::shutdown(number_, SHUT_WR); }
    void close() {
        if (number_ >= 0) ::close(number_);
        number_ = -1;
    }

  private:
    static sockaddr_in loopback(int port) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(std::uint16_t(port));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        return address;
    }
    int number_;
};

/// A relay that runs, its target, and on demand connections through it.
struct Bench {
    Plain target = Plain::listening();
    std::unique_ptr<ChaosRelay> relay;
    std::thread loop;

    explicit Bench(ChaosRelayConfig config = {}) {
        config.listen_ports = {0};
        config.target_ports = {target.port()};
        auto made = ChaosRelay::create(config);
        REQUIRE(bool(made));
        relay = std::move(*made);
        loop = std::thread([this] { relay->run(monotonic_now); });
    }
    ~Bench() { stop(); }
    void stop() {
        relay->request_stop();
        if (loop.joinable()) loop.join();
    }
    Plain dialled() const { return Plain::dialled(relay->ports()[0]); }

    /// Applies the command and waits until it has taken effect.
    void apply(std::string_view command) {
        const std::uint64_t before = relay->stats().commands;
        REQUIRE(bool(relay->apply(command)));
        REQUIRE(becomes([&](const ChaosRelayStats& stats) { return stats.commands > before; }));
    }
    bool becomes(const std::function<bool(const ChaosRelayStats&)>& condition) const {
        const TimeNs deadline = monotonic_now() + testing::k_patience;
        while (!condition(relay->stats())) {
            if (monotonic_now() > deadline) return false;
            std::this_thread::yield();
        }
        return true;
    }
    ChaosLinkStats link() const { return relay->stats().links.at(0); }
};

std::string pattern(std::size_t size, std::uint64_t seed = 1) {
    ChaosDraws draws(seed);
    std::string text(size, '\0');
    for (char& c : text) c = char(draws.next());
    return text;
}

/// Sends all of it to a target that echoes, and gives back what returns.
std::string echoed(const Plain& dialler, const Plain& target, const std::string& bytes) {
    std::thread echo([&] {
        for (std::size_t left = bytes.size(); left > 0;) {
            const std::string part = target.receive(std::min<std::size_t>(left, 1 << 16));
            if (part.empty()) return;
            target.send_all(part);
            left -= part.size();
        }
    });
    std::thread sender([&] { dialler.send_all(bytes); });
    std::string back = dialler.receive(bytes.size());
    sender.join();
    echo.join();
    return back;
}

/// What the kernel holds at most between a sender and a receiver of ours: it doubles what a socket asks for,
/// for our two and the relay's two.
constexpr std::size_t k_kernel_bytes = 2 * 2 * (k_socket_bytes + (256 << 10));

}  // namespace

TEST_CASE("some megabytes come back as they went through delay and jitter") {
    Bench bench;
    bench.apply("fault delay 5ms jitter 5ms");
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    const std::string bytes = pattern(8 << 20);
    const TimeNs start = monotonic_now();
    CHECK(echoed(dialler, target, bytes) == bytes);
    CHECK(monotonic_now() - start >= 10 * k_ms);
    bench.stop();
    const ChaosLinkStats link = bench.link();
    CHECK(link.connections == 1);
    for (const ChaosCounts& counts : link.directions) {
        CHECK(counts.bytes_in == bytes.size());
        CHECK(counts.bytes_out == bytes.size());
        CHECK(counts.flips == 0);
    }
}

TEST_CASE("a round trip takes two delays at least, one if one direction is delayed") {
    Bench bench;
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    for (const auto& [command, least] :
         {std::pair{"fault delay 40ms", 80 * k_ms}, std::pair{"fault clear up", 40 * k_ms}}) {
        bench.apply(command);
        const TimeNs start = monotonic_now();
        CHECK(echoed(dialler, target, "ping") == "ping");
        CHECK(monotonic_now() - start >= least);
    }
}

TEST_CASE("a rate holds over a real connection") {
    Bench bench;
    bench.apply("fault rate 2MB/s up");
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    const std::string bytes = pattern(500'000);
    const TimeNs start = monotonic_now();
    std::thread sender([&] { dialler.send_all(bytes); });
    CHECK(target.receive(bytes.size()) == bytes);
    sender.join();
    // (500,000 - depth 20,000) / 2 MB/s
    CHECK(monotonic_now() - start >= 240 * k_ms);
}

TEST_CASE("a cut is a reset at both ends, and new connections are welcome") {
    Bench bench;
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    CHECK(echoed(dialler, target, "hello") == "hello");
    bench.apply("fault cut");
    CHECK(dialler.ending() == ECONNRESET);
    CHECK(target.ending() == ECONNRESET);
    const Plain again = bench.dialled(), target_again = bench.target.accepted();
    CHECK(echoed(again, target_again, "hello") == "hello");
    CHECK(bench.link().cuts == 1);
    CHECK(bench.link().resets == 0);
}

TEST_CASE("refused connections are reset, until they are not") {
    Bench bench;
    bench.apply("fault refuse on");
    const Plain refused = bench.dialled();
    CHECK(refused.ending() == ECONNRESET);
    bench.apply("fault refuse off");
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    CHECK(echoed(dialler, target, "hello") == "hello");
    CHECK(bench.link().refused == 1);
}

TEST_CASE("a half-close is an end of stream in one direction while the other flows") {
    Bench bench;
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    dialler.send_all("before");
    CHECK(target.receive(6) == "before");
    bench.apply("fault half-close up");
    CHECK(target.ending() == 0);
    for (int i = 0; i < 3; ++i) {
        target.send_all("downwards");
        CHECK(dialler.receive(9) == "downwards");
        dialler.send_all("into the void");
    }
    CHECK(bench.becomes([](const auto& stats) { return stats.links[0].directions[0].bytes_dropped == 39; }));
    CHECK(bench.link().half_closes == std::array<std::uint64_t, 2>{1, 0});
    target.end_sending();
    CHECK(dialler.ending() == 0);
    CHECK(bench.becomes([](const auto& stats) { return stats.links[0].open == 0; }));
    CHECK(bench.link().resets == 0);
}

TEST_CASE("an end of stream travels behind the bytes, each way by itself") {
    Bench bench;
    bench.apply("fault delay 10ms");
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    const std::string bytes = pattern(300'000);
    std::thread sender([&] {
        dialler.send_all(bytes);
        dialler.end_sending();
    });
    CHECK(target.receive(bytes.size() + 1) == bytes);
    sender.join();
    target.send_all("thank you");
    target.end_sending();
    CHECK(dialler.receive(100) == "thank you");
    CHECK(bench.becomes([](const auto& stats) { return stats.links[0].open == 0; }));
    CHECK(bench.link().resets == 0);
}

TEST_CASE("a peer's reset is passed on") {
    Bench bench;
    Plain dialler = bench.dialled();
    const Plain target = bench.target.accepted();
    target.send_all("unread");
    REQUIRE(dialler.wait(POLLIN));
    dialler.close();  // With bytes unread, this is a reset.
    CHECK(target.ending() == ECONNRESET);
    CHECK(bench.becomes([](const auto& stats) { return stats.links[0].resets == 1; }));
}

TEST_CASE("a target that nobody listens at resets who dials") {
    Bench bench;
    bench.target.close();
    const Plain dialler = bench.dialled();
    CHECK(dialler.ending() == ECONNRESET);
    CHECK(bench.becomes([](const auto& stats) { return stats.links[0].unreachable == 1; }));
}

TEST_CASE("a black hole lets nothing through, and everything once it is gone") {
    Bench bench;
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    bench.apply("fault black-hole on up");
    const std::string bytes = pattern(100'000);
    dialler.send_all(bytes);
    CHECK(bench.becomes([](const auto& stats) { return stats.links[0].directions[0].bytes_in == 100'000; }));
    CHECK_FALSE(target.wait(POLLIN, 50 * k_ms));
    target.send_all("the other way");
    CHECK(dialler.receive(13) == "the other way");
    bench.apply("fault black-hole off");
    CHECK(target.receive(bytes.size()) == bytes);
}

TEST_CASE("flipped bytes arrive flipped, the same ones for the same seed") {
    const std::string bytes = pattern(200'000);
    const auto received = [&](std::uint64_t seed) {
        Bench bench({.seed = seed});
        bench.apply("fault flip 1e-3 up");
        const Plain dialler = bench.dialled(), target = bench.target.accepted();
        std::thread sender([&] { dialler.send_all(bytes); });
        std::string got = target.receive(bytes.size());
        sender.join();
        std::uint64_t wrong = 0;
        for (std::size_t i = 0; i < std::min(got.size(), bytes.size()); ++i) wrong += got[i] != bytes[i];
        CHECK(wrong > 0);
        CHECK(bench.becomes([&](const auto& stats) { return stats.links[0].directions[0].flips == wrong; }));
        return got;
    };
    const std::string first = received(5);
    CHECK(first == received(5));
    CHECK(first != received(6));
}

TEST_CASE("a reader that does not read: the writer is stopped, and memory is bounded") {
    constexpr std::size_t k_buffer = 1 << 20;
    Bench bench({.buffer_bytes = k_buffer});
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    const std::size_t most = k_buffer + k_kernel_bytes;
    const std::string part = pattern(1 << 16);
    std::size_t sent = 0;
    // Stopped: no room for a quarter of a second, in which otherwise hundreds of megabytes would flow.
    while (dialler.wait(POLLOUT, 250 * k_ms) && sent <= most) sent += dialler.send_some(part);
    CHECK(sent <= most);
    const ChaosCounts up = bench.link().directions[0];
    CHECK(up.most_held_bytes == k_buffer);
    CHECK(up.bytes_in - up.bytes_out == k_buffer);

    // The other direction, and what waited, are whole.
    target.send_all("still here");
    CHECK(dialler.receive(10) == "still here");
    dialler.end_sending();
    std::size_t received = 0;
    for (std::string got = target.receive(1 << 16); !got.empty(); got = target.receive(1 << 16))
        received += got.size();
    CHECK(received == sent);
}

TEST_CASE("a slow reader slows the writer") {
    constexpr std::size_t k_buffer = 1 << 16, k_slack = k_buffer + k_kernel_bytes;
    Bench bench({.buffer_bytes = k_buffer});
    const Plain dialler = bench.dialled(), target = bench.target.accepted();
    const std::string part = pattern(1 << 16);
    std::size_t sent = 0, received = 0;
    // In lock step: the writer writes until it is stopped, the reader takes up to 256 KiB. So the writer is never
    // further ahead than all buffers on the way hold.
    while (received < 8 * k_slack) {
        while (sent <= received + k_slack) {
            if (!dialler.wait(POLLOUT, received == 0 ? 100 * k_ms : 1 * k_ms)) break;
            sent += dialler.send_some(part);
        }
        REQUIRE(sent <= received + k_slack);
        // The writer may have stopped for a relay that had no time: then less than that is on its way.
        const std::size_t due = std::min<std::size_t>(256 << 10, sent - received);
        REQUIRE(target.receive(due).size() == due);
        received += due;
    }
    CHECK(bench.link().directions[0].most_held_bytes <= k_buffer);
}

TEST_CASE("no more connections are taken than allowed; the others wait") {
    Bench bench({.most_connections = 2});
    Plain first = bench.dialled(), first_target = bench.target.accepted();
    const Plain second = bench.dialled(), second_target = bench.target.accepted();
    const Plain third = bench.dialled();
    third.send_all("wait");
    CHECK_FALSE(bench.target.wait(POLLIN, 50 * k_ms));
    first.close();
    first_target.close();
    const Plain third_target = bench.target.accepted();
    CHECK(third_target.receive(4) == "wait");
}

TEST_CASE("commands for one link leave the others alone; links that are not there are refused") {
    const Plain a = Plain::listening(), b = Plain::listening();
    auto relay = ChaosRelay::create({.listen_ports = {0, 0}, .target_ports = {a.port(), b.port()}});
    REQUIRE(bool(relay));
    std::thread loop([&] { (*relay)->run(monotonic_now); });
    {
        const Plain to_a = Plain::dialled((*relay)->ports()[0]), to_b = Plain::dialled((*relay)->ports()[1]);
        const Plain at_a = a.accepted(), at_b = b.accepted();
        CHECK(bool((*relay)->apply("fault cut link 1")));
        CHECK(to_a.ending() == ECONNRESET);
        CHECK(echoed(to_b, at_b, "hello") == "hello");
        CHECK(bool((*relay)->apply("fault cut port " + std::to_string((*relay)->ports()[1]))));
        CHECK(to_b.ending() == ECONNRESET);
    }
    CHECK_FALSE(bool((*relay)->apply("fault cut link 3")));
    CHECK_FALSE(bool((*relay)->apply("fault cut port 1")));
    CHECK_FALSE(bool((*relay)->apply("fault loss")));
    (*relay)->request_stop();
    loop.join();
}

TEST_CASE("what cannot be listened to or found is refused with a sentence") {
    CHECK_FALSE(bool(ChaosRelay::create({})));
    CHECK_FALSE(bool(ChaosRelay::create({.listen_ports = {0, 0}, .target_ports = {1}})));
    const Plain taken = Plain::listening();
    const auto busy = ChaosRelay::create({.listen_ports = {taken.port()}, .target_ports = {1}});
    REQUIRE_FALSE(bool(busy));
    CHECK(busy.error().message.find(std::to_string(taken.port())) != std::string::npos);
    const auto open =
        ChaosRelay::create({.listen_host = "0.0.0.0", .listen_ports = {0}, .target_ports = {1}});
    REQUIRE_FALSE(bool(open));
    CHECK(open.error().message.find("--insecure") != std::string::npos);
    const auto nowhere =
        ChaosRelay::create({.listen_ports = {0}, .target_host = "no.such.host.invalid", .target_ports = {1}});
    REQUIRE_FALSE(bool(nowhere));
    CHECK(nowhere.error().message.find("no.such.host.invalid") != std::string::npos);
}

TEST_CASE(
    "ZeroMQ through the relay: messages are whole or absent under cuts and flipped bytes in the handshake") {
    const Context context;
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(router));
    const std::string endpoint = router->endpoint();
    const int port = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
    auto relay = ChaosRelay::create({.listen_ports = {0}, .target_ports = {port}, .seed = 3});
    REQUIRE(bool(relay));
    // With one byte in ten wrong, neither ZMTP's greeting of 64 bytes nor what follows it gets through.
    REQUIRE(bool((*relay)->apply("fault flip 0.1 up")));
    std::thread loop([&] { (*relay)->run(monotonic_now); });
    SocketOptions options;
    options.reconnect_ms = 10;
    options.reconnect_max_ms = 10;
    const std::string through = "tcp://127.0.0.1:" + std::to_string((*relay)->ports()[0]);
    auto dealer = DealerSocket::connect(context, through, "d", options);
    REQUIRE(bool(dealer));
    const TimeNs deadline = monotonic_now() + testing::k_patience;
    std::uint64_t greeted =
        0;  // Connections whose greeting was spoilt; each is then cut, as ZeroMQ waits for long.
    while (greeted < 5 && monotonic_now() < deadline) {
        const auto link = (*relay)->stats().links[0];
        if (link.connections > greeted && link.directions[0].bytes_out >= 10 * link.connections) {
            greeted = link.connections;
            CHECK_FALSE(wait_readable({router->pollable()}, 5 * k_ms)[0]);
            REQUIRE(bool((*relay)->apply("fault cut")));
        } else {
            std::this_thread::yield();
        }
    }
    CHECK(greeted >= 5);
    CHECK_FALSE(router->receive());

    // A good line from here on, cut again and again: whatever arrives is one of the messages, unchanged.
    REQUIRE(bool((*relay)->apply("fault clear")));
    REQUIRE(bool((*relay)->apply("fault cut")));
    const std::string message = pattern(50'000);
    int arrived = 0;
    for (int i = 0; i < 30 && monotonic_now() < deadline; ++i) {
        (void)testing::send_once_connected(*dealer, {message});
        if (i % 3 == 0) REQUIRE(bool((*relay)->apply("fault cut")));
        (void)wait_readable({router->pollable()}, 50 * k_ms);
        while (const auto got = router->receive()) {
            ++arrived;
            REQUIRE(got->frames.size() == 1);
            CHECK(got->frames[0] == message);
        }
    }
    CHECK(arrived > 0);
    (*relay)->request_stop();
    loop.join();
}
