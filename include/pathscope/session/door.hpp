#pragma once
/// The client's door: who may come in, and who was turned away and why.
///
///     door = Door::open(context, config);                     keys and list are read, local servers get keys
///     socket = bind(..., door.options(channel));
///     door.watch(input, monitor, frames);
///     each step:   news = door.step(now, input);
///
/// With keys, nobody but the listed and this client's own local servers completes a handshake, and who is taken off the
/// list is not heard any more (router.hpp). Without keys, the door opens on this machine only, unless the user insists.
/// Who was refused is counted, and told with the reason, each sentence once a minute.
/// Thread safety: one thread at a time.   Test: tests/session/test_door.cpp, tests/system/test_security.py

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pathscope/net/allow_list.hpp"
#include "pathscope/net/connection_watch.hpp"
#include "pathscope/net/publisher.hpp"
#include "pathscope/net/router.hpp"
#include "pathscope/protocol/table.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/refusal.hpp"

namespace pathscope {

/// A folder of this run that only this user can enter; removed at the end with what is in it.
class PrivateFolder {
  public:
    [[nodiscard]] static Result<PrivateFolder> create();
    PrivateFolder(PrivateFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
    PrivateFolder& operator=(PrivateFolder&& other) noexcept {
        std::swap(path_, other.path_);
        return *this;
    }
    ~PrivateFolder();

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  private:
    explicit PrivateFolder(std::filesystem::path path) : path_(std::move(path)) {}
    std::filesystem::path path_;
};

/// Whether a client may listen there: a sentence if other machines could reach the address and there are neither keys
/// nor the user's word.
[[nodiscard]] Result<void> check_listening(const ClientConfig& config);

class Door {
  public:
    [[nodiscard]] static Result<Door> open(const Context& context, const ClientConfig& config);

    [[nodiscard]] SocketOptions options(Channel channel) const;

    /// From here on refusals are seen. Requires: sockets made with options().
    [[nodiscard]] Result<void> watch(const PublisherSocket& input, const RouterSocket& monitor,
                                     const RouterSocket& frames);

    /// What local server `index`, from 0, is to be started with: a throw-away key, in a file. Nothing without keys.
    [[nodiscard]] std::vector<std::string> arguments_of_local_server(int index) const;

    /// Connections, since the last time.
    struct News {
        std::uint64_t refused = 0;
        std::uint64_t lost = 0;  ///< Of those that had been let in.
    };
    /// Reads the list again if it is time to, and tells of refusals. To be called several times a second, and when any of
    /// pollables() is ready.
    News step(TimeNs now, PublisherSocket& input);
    [[nodiscard]] std::vector<Pollable> pollables() const;
    [[nodiscard]] std::size_t watched() const { return watches_.size(); }  ///< As many are its pollables.

  private:
    explicit Door(const Context& context) : context_(context) {}
    Result<void> make_local_keys(int servers);
    Result<void> admit();
    void tell(const std::string& sentence, TimeNs now);

    Context context_;
    std::optional<KeyPair> keys_;
    std::optional<AllowList> list_;
    std::vector<std::string> local_keys_;  ///< Public ones.
    std::optional<PrivateFolder> local_key_folder_;
    std::vector<ConnectionWatch> watches_;
    SaidOnce said_;
};

}  // namespace pathscope
