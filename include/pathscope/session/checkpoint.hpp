#pragma once
/// Checkpoints: a frame on disk, so that a client that was killed goes on where it was.
///
///     file   = magic version header-size header *array seal
///     seal   = BLAKE2b(all bytes before it)                                   ; 32 bytes
///     array  = *piece                                                         ; of 64-bit words
///     piece  = packed-size codec packed-bytes                                 ; 2^17 words each, the last one fewer
///
/// The header is a MessagePack map: what work this is, what has been counted, and how many words the arrays have that the
/// work alone does not tell. Bytes and fields one by one: docs/checkpoints.md.
///
/// Why exact: sums are integers and rounds are committed once, so a frame that goes on holds the same bits as one that was
/// never interrupted; with passes, all that decides about the next one is kept (frame_snapshot.hpp).
/// Safety: the seal is checked before anything is read, and refuses what is damaged or cut off. It is no signature: what a
/// file with a right seal says is checked like a message from the network. Memory is taken for the frame that is asked
/// for, whatever the file claims.
/// Thread safety: values.   Test: tests/session/test_checkpoint.cpp, tests/system/test_checkpoint.py

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/image/dropped_sample.hpp"
#include "pathscope/probe/event_store.hpp"
#include "pathscope/session/frame_snapshot.hpp"
#include "pathscope/session/work_identity.hpp"

namespace pathscope {

/// What was done for the frame so far, so that statistics stay true: of committed rounds alone.
struct WorkHistory {
    std::uint32_t runs = 0;    ///< Programs that worked on it.
    double render_s = 0;       ///< Of all of them, but for what they lost.
    std::uint64_t rounds = 0;  ///< Of indirect light.
    std::uint64_t tiles = 0, rays = 0, samples = 0, nonfinite_dropped = 0, saturated = 0;
    std::vector<DroppedSample> dropped;  ///< Some of those in nonfinite_dropped.
    std::uint64_t differing_rounds = 0;  ///< Of servers whose bits may differ: above 0, the image is marked.
};

struct Checkpoint {
    WorkIdentity work;
    WorkHistory history;
    FrameSnapshot frame;
};

[[nodiscard]] std::string encode_checkpoint(const Checkpoint& checkpoint);

/// A file that is whole, and of which the header has been read. Its sums are unpacked when it is known whose they are.
class CheckpointFile {
  public:
    [[nodiscard]] static Result<CheckpointFile> read(const std::filesystem::path& path);
    /// `name` is for sentences.
    [[nodiscard]] static Result<CheckpointFile> parse(std::string bytes, std::string name);

    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] const WorkIdentity& work() const { return work_; }
    [[nodiscard]] const WorkHistory& history() const { return history_; }

    /// Requires: the grid is that of work().
    [[nodiscard]] Result<FrameSnapshot> frame(const BlockGrid& grid) const;

  private:
    struct PartHeader {
        std::uint32_t samples = 0;
        std::uint32_t missing = 0;
        bool has_noise = false;
        double mean = 0;
    };

    CheckpointFile() = default;
    Result<void> read_header(std::string_view header);

    std::string name_;
    std::string bytes_;
    std::size_t arrays_begin_ = 0, arrays_end_ = 0;
    WorkIdentity work_;
    WorkHistory history_;
    std::uint32_t passes_finished_ = 0;
    bool last_pass_finished_ = false;
    PartHeader direct_, indirect_;
};

/// Gives `work` what the file has, and `store` what was counted. An error names the file, and what of the work differs.
/// Requires: `work` was begun with `state`, and no round of it granted.
[[nodiscard]] Result<void> take_up(const CheckpointFile& file, const RenderState& state, FrameWork& work,
                                   EventStore& store);

}  // namespace pathscope
