#pragma once
/// Bytes in at the back, out at the front, held in pieces of 64 KiB that are freed as they empty.
///
/// Why not one vector or one ring: what is taken from the front of a vector is moved by each append, and a
/// ring is as large as its limit even when it is empty, which a relay has two of per connection.
/// Thread safety: none.   Test: tests/net/test_chaos_stream.cpp

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <deque>
#include <memory>
#include <span>

#include "pathscope/core/check.hpp"

namespace pathscope {

class ByteQueue {
  public:
    static constexpr std::size_t k_piece_bytes = 64 << 10;

    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }

    void append(std::span<const std::byte> bytes) {
        while (!bytes.empty()) {
            const std::size_t end = head_ + size_, used = end % k_piece_bytes;
            if (end / k_piece_bytes == pieces_.size()) pieces_.emplace_back(new Piece);
            const std::size_t count = std::min(bytes.size(), k_piece_bytes - used);
            std::memcpy(pieces_.back()->data() + used, bytes.data(), count);
            size_ += count;
            bytes = bytes.subspan(count);
        }
    }

    /// The first bytes, as many as lie in one piece; empty only when the queue is.
    [[nodiscard]] std::span<const std::byte> front() const {
        if (empty()) return {};
        return std::span<const std::byte>(*pieces_.front())
            .subspan(head_, std::min(size_, k_piece_bytes - head_));
    }

    /// Requires: index < size(); 0 is the front.
    [[nodiscard]] std::byte& operator[](std::size_t index) {
        const std::size_t place = head_ + index;
        return (*pieces_[place / k_piece_bytes])[place % k_piece_bytes];
    }

    /// Requires: count <= size().
    void pop(std::size_t count) {
        CHECK(count <= size_, count, size_);
        head_ += count;
        size_ -= count;
        for (; head_ >= k_piece_bytes; head_ -= k_piece_bytes) pieces_.pop_front();
        if (size_ == 0) {
            pieces_.clear();
            head_ = 0;
        }
    }

  private:
    using Piece = std::array<std::byte, k_piece_bytes>;
    std::deque<std::unique_ptr<Piece>> pieces_;
    std::size_t head_ = 0;  ///< Where the front lies in the first piece.
    std::size_t size_ = 0;
};

}  // namespace pathscope
