#include "pathscope/session/door.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>

#include "channel_options.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/net/key_file.hpp"

namespace pathscope {
namespace {

std::string key_file_name(int server) { return fmt::format("server-{}.key", server + 1); }

}  // namespace

Result<PrivateFolder> PrivateFolder::create() {
    std::error_code error;
    const std::filesystem::path temporary = std::filesystem::temp_directory_path(error);
    std::string path = (temporary / "pathscope-keys-XXXXXX").string();
    if (error || !::mkdtemp(path.data()))  // Made with mode 0700.
        return failed(fmt::format("Cannot make a private folder in {}: {}.", temporary.string(),
                                  error ? error.message() : std::generic_category().message(errno)));
    return PrivateFolder(path);
}

PrivateFolder::~PrivateFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

Result<void> check_listening(const ClientConfig& config) {
    if (config.keys || config.insecure || !reaches_other_machines(fmt::format("tcp://{}:1", config.host)))
        return {};
    return bad_input(
        fmt::format("--listen {}: other machines could reach this address, and nothing is encrypted or "
                    "checked. Give --key and --allow; or --insecure, if the network is trusted.",
                    config.host));
}

Result<Door> Door::open(const Context& context, const ClientConfig& config) {
    if (const auto allowed = check_listening(config); !allowed) return allowed.error();
    Door door(context);
    if (!config.keys) {
        if (reaches_other_machines(fmt::format("tcp://{}:1", config.host)))
            log_warning(fmt::format(
                "Insecure: whoever reaches {} can take part in this render, see the scene and read "
                "what is sent.",
                config.host));
        return door;
    }
    door.keys_ = config.keys->pair;
    if (!config.keys->allow_list.empty()) {
        Result<AllowList> list = AllowList::open(config.keys->allow_list);
        if (!list) return list.error();
        door.list_ = std::move(*list);
    }
    if (const auto made = door.make_local_keys(config.local_servers); !made) return made.error();
    if (const auto admitted = door.admit(); !admitted) return admitted.error();
    return door;
}

Result<void> Door::make_local_keys(int servers) {
    if (servers == 0) return {};
    Result<PrivateFolder> folder = PrivateFolder::create();
    if (!folder) return folder.error();
    local_key_folder_ = std::move(*folder);
    for (int i = 0; i < servers; ++i) {
        const KeyPair keys = make_key_pair();
        const auto written = write_key_files(local_key_folder_->path() / key_file_name(i), keys);
        if (!written) return written.error();
        local_keys_.push_back(keys.public_key);
    }
    return {};
}

Result<void> Door::admit() {
    std::vector<std::string> keys = local_keys_;
    if (list_) keys.insert(keys.end(), list_->keys().begin(), list_->keys().end());
    return admit_only(context_, keys);
}

SocketOptions Door::options(Channel channel) const {
    SocketOptions options = channel_options(channel);
    if (keys_) options.security = Listener{*keys_};
    return options;
}

Result<void> Door::watch(const PublisherSocket& input, const RouterSocket& monitor,
                         const RouterSocket& frames) {
    std::vector<ConnectionWatch> watches;
    const auto add = [&](const auto& socket) -> Result<void> {
        auto watch = ConnectionWatch::watch(context_, socket);
        if (!watch) return watch.error();
        watches.push_back(std::move(*watch));
        return {};
    };
    if (const auto added = add(input); !added) return added;
    if (const auto added = add(monitor); !added) return added;
    if (const auto added = add(frames); !added) return added;
    watches_ = std::move(watches);
    return {};
}

std::vector<std::string> Door::arguments_of_local_server(int index) const {
    if (!keys_) return {};
    return {"--key", (local_key_folder_->path() / key_file_name(index)).string(), "--server-key",
            keys_->public_key};
}

Door::News Door::step(TimeNs now, PublisherSocket& input) {
    if (list_ && list_->changed(now)) {
        log_note(fmt::format("The list of those who may come in has changed; it has {} key{}.",
                             list_->keys().size(), list_->keys().size() == 1 ? "" : "s"));
        CHECK(bool(admit()));  // The list holds keys only.
        input.disconnect_unlisted();
    }
    News news;
    for (ConnectionWatch& watch : watches_) {
        const ConnectionChanges changes = watch.take_changes();
        news.lost += std::uint64_t(changes.lost);
        for (const Refusal& refusal : changes.refusals) {
            ++news.refused;
            // Whose key it was is told below.
            if (refusal.reason != RefusalReason::unlisted_key)
                tell(refusal_at_client(refusal, keys_ ? keys_->public_key : ""), now);
        }
    }
    for (const RefusedKey& refused : take_refused_keys(context_)) tell(refusal_at_client(refused), now);
    return news;
}

std::vector<Pollable> Door::pollables() const {
    std::vector<Pollable> all;
    for (const ConnectionWatch& watch : watches_) all.push_back(watch.pollable());
    return all;
}

void Door::tell(const std::string& sentence, TimeNs now) {
    if (const auto said = said_.say(sentence, now)) log_warning(*said);
}

}  // namespace pathscope
