#include "doorkeeper.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <utility>

#include "pathscope/core/check.hpp"
#include "pathscope/net/poller.hpp"
#include "zmq_call.hpp"

namespace pathscope {
namespace {

const char* const k_zap_address = "inproc://zeromq.zap.01";  // Fixed by RFC 27.
constexpr std::size_t k_key_bytes = 32;
constexpr std::size_t k_max_refused = 1000;  ///< Kept until they are taken; more are refused all the same.

std::string to_z85(const std::string& key) {
    char text[5 * k_key_bytes / 4 + 1];
    CHECK(key.size() == k_key_bytes, key.size());
    zmq_z85_encode(text, reinterpret_cast<const std::uint8_t*>(key.data()), key.size());
    return text;
}

}  // namespace

Result<std::unique_ptr<Doorkeeper>> Doorkeeper::start(void* zmq_context) {
    auto stop = WakePair::create();
    if (!stop) return stop.error();
    // A ROUTER in place of the usual REP: a request that is not answered then blocks nothing.
    void* socket = zmq_socket(zmq_context, ZMQ_ROUTER);
    if (!socket) return failed(fmt::format("Cannot open a socket: {}.", zmq_strerror(errno)));
    set_option(socket, ZMQ_LINGER, 0);
    CHECK(zmq_bind(socket, k_zap_address) == 0, zmq_strerror(errno));
    return std::unique_ptr<Doorkeeper>(new Doorkeeper(socket, std::move(*stop)));
}

Doorkeeper::Doorkeeper(void* socket, WakePair stop) : socket_(socket), stop_(std::move(stop)) {
    thread_ = std::thread([this] { serve(); });
}

Doorkeeper::~Doorkeeper() {
    stop_.notify();
    thread_.join();
    zmq_close(socket_);
}

void Doorkeeper::admit_only(const std::vector<std::string>& public_keys) {
    const std::scoped_lock lock(mutex_);
    admitted_ = {public_keys.begin(), public_keys.end()};
}

bool Doorkeeper::admits(const std::string& public_key) const {
    const std::scoped_lock lock(mutex_);
    return admitted_.contains(public_key);
}

std::vector<RefusedKey> Doorkeeper::take_refused() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(refused_, {});
}

void Doorkeeper::serve() {
    while (!wait_readable({stop_.pollable(), Pollable{socket_}}, -1)[0]) {
        while (const auto request = receive_frames(socket_)) {
            Frames reply = answer(*request);
            if (!reply.empty()) (void)send_frames(socket_, &request->front(), reply);
        }
    }
}

/// request:  peer, "", version, request id, domain, address, routing id, mechanism, public key
/// reply:    "", version, request id, status code, status text, user id, metadata
Frames Doorkeeper::answer(const Frames& request) {
    if (request.size() < 4) return {};
    const std::string &version = request[2], &id = request[3];
    if (request.size() == 9 && request[7] == "CURVE" && request[8].size() == k_key_bytes) {
        const std::string key = to_z85(request[8]);
        const std::scoped_lock lock(mutex_);
        if (admitted_.contains(key)) return {"", version, id, "200", "OK", key, ""};
        if (refused_.size() < k_max_refused) refused_.push_back({key, request[5]});
    }
    return {"", version, id, "400", "this key is not on the list", "", ""};
}

}  // namespace pathscope
