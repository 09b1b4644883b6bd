#pragma once
/// Getting the files of a scene: the server's side of MANIFEST and PIECE.
///
///     SceneFetch fetch(cache, state.files);
///     for (Message& ask : fetch.requests(now)) send(ask);      // whenever something changed, and on a timer
///     fetch.on_manifest(...), fetch.on_piece(...);             // until complete()
///
/// A pure state machine but for the cache's files: no socket, no clock. At most k_unanswered requests are on their way; one
/// that got no answer for k_patience is asked again. What is in the cache is not asked for.
/// Errors: a list or a file whose hash is not the one that was asked for is refused and asked for again.
/// Thread safety: one thread at a time.   Test: tests/session/test_scene_fetch.cpp

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pathscope/core/check.hpp"
#include "pathscope/core/clock.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/protocol/message.hpp"
#include "pathscope/scene/file_source.hpp"
#include "pathscope/session/scene_cache.hpp"

namespace pathscope {

class SceneFetch {
  public:
    static constexpr std::size_t k_unanswered = 4;
    static constexpr TimeNs k_patience = 2 * k_second_ns;

    /// `files` is the hash of the packed manifest, as the render state names it.
    SceneFetch(SceneCache cache, const Digest& files) : cache_(std::move(cache)), files_(files) {}

    /// What to ask now.
    [[nodiscard]] std::vector<Message> requests(TimeNs now);

    /// Errors say what was refused; the request is made again.
    [[nodiscard]] Result<void> on_manifest(const message::Manifest& manifest);
    [[nodiscard]] Result<void> on_piece(message::Piece piece);

    [[nodiscard]] bool complete() const { return manifest_ && missing_.empty(); }

    /// Requires: complete().
    [[nodiscard]] const Manifest& manifest() const {
        CHECK(complete());
        return *manifest_;
    }

  private:
    /// A file on its way.
    struct Download {
        ManifestEntry entry;
        std::string bytes;
    };
    struct Asked {
        std::uint64_t length = 0;
        TimeNs at = 0;
    };

    void ask_piece(const Download& file, std::uint64_t offset, TimeNs now, std::vector<Message>& out);
    void give_up_file();

    SceneCache cache_;
    Digest files_;
    std::optional<Manifest> manifest_;
    std::optional<TimeNs> manifest_asked_;
    std::deque<Download> missing_;                ///< The first one is being fetched.
    std::map<std::uint64_t, Asked> unanswered_;   ///< Pieces of it, by offset.
    std::map<std::uint64_t, std::string> early_;  ///< Pieces that arrived before one in front of them.
    std::uint64_t next_offset_ = 0;               ///< First byte of it that was not asked for yet.
};

}  // namespace pathscope
