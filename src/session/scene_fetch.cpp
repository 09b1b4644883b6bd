#include "pathscope/session/scene_fetch.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/protocol/table.hpp"
#include "pathscope/session/render_state.hpp"

namespace pathscope {

std::vector<Message> SceneFetch::requests(TimeNs now) {
    std::vector<Message> out;
    const auto overdue = [now](TimeNs asked) { return now - asked >= k_patience; };
    if (!manifest_) {
        if (!manifest_asked_ || overdue(*manifest_asked_)) {
            out.push_back(message::ManifestRequest{files_});
            manifest_asked_ = now;
        }
        return out;
    }
    if (missing_.empty()) return out;

    const Download& file = missing_.front();
    for (auto& [offset, asked] : unanswered_)
        if (overdue(asked.at)) ask_piece(file, offset, now, out);
    while (unanswered_.size() < k_unanswered && next_offset_ < file.entry.size) {
        ask_piece(file, next_offset_, now, out);
        next_offset_ += unanswered_[next_offset_].length;
    }
    return out;
}

void SceneFetch::ask_piece(const Download& file, std::uint64_t offset, TimeNs now,
                           std::vector<Message>& out) {
    const std::uint64_t length = std::min<std::uint64_t>(k_max_piece_bytes, file.entry.size - offset);
    unanswered_[offset] = {length, now};
    out.push_back(message::PieceRequest{file.entry.hash, offset, std::uint32_t(length)});
}

Result<void> SceneFetch::on_manifest(const message::Manifest& message) {
    if (manifest_ || message.scene != files_) return {};  // Asked for twice, or for a scene of before.
    manifest_asked_.reset();
    if (hash_text(message.files) != files_)
        return failed(
            "The list of scene files arrived damaged: its hash is not the one of the render state.");
    Result<Manifest> manifest = unpack_manifest(message.files);
    if (!manifest) return manifest.error();

    for (const ManifestEntry& entry : manifest->files) {
        const auto same_content = [&](const Download& other) { return other.entry.hash == entry.hash; };
        if (cache_.holds(entry.hash, entry.size) ||
            std::any_of(missing_.begin(), missing_.end(), same_content))
            continue;
        if (entry.size > 0) {
            missing_.push_back({entry, {}});
        } else if (const auto stored = cache_.store(entry.hash, ""); !stored) {
            return stored.error();
        }
    }
    manifest_ = std::move(*manifest);
    return {};
}

Result<void> SceneFetch::on_piece(message::Piece piece) {
    if (missing_.empty() || piece.hash != missing_.front().entry.hash) return {};
    const auto asked = unanswered_.find(piece.offset);
    if (asked == unanswered_.end()) return {};
    Download& file = missing_.front();
    if (piece.total != file.entry.size || piece.bytes.size() != asked->second.length) {
        give_up_file();
        return failed(
            fmt::format("The scene file {} changed at the client while it was sent.", file.entry.name));
    }
    unanswered_.erase(asked);
    early_.emplace(piece.offset, std::move(piece.bytes));

    // Put what is contiguous in place; once the file is whole, its hash decides.
    for (auto next = early_.find(file.bytes.size()); next != early_.end();
         next = early_.find(file.bytes.size())) {
        file.bytes += next->second;
        early_.erase(next);
    }
    if (file.bytes.size() < file.entry.size) return {};
    const Result<void> stored = cache_.store(file.entry.hash, file.bytes);
    if (!stored) {
        give_up_file();
        return stored.error();
    }
    missing_.pop_front();
    next_offset_ = 0;
    return {};
}

/// Starts the file again from its first byte.
void SceneFetch::give_up_file() {
    missing_.front().bytes.clear();
    unanswered_.clear();
    early_.clear();
    next_offset_ = 0;
}

}  // namespace pathscope
