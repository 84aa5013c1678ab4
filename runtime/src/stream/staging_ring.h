// Memory through which everything goes to the device: mapped once, taken in order, given back in order.
#ifndef BILLOW_RUNTIME_STREAM_STAGING_RING_H
#define BILLOW_RUNTIME_STREAM_STAGING_RING_H

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "memory.h"

namespace billow::runtime {

// Positions in the ring's endless course.
class RingSpace {
 public:
  explicit RingSpace(std::uint64_t size) : size_(size) {}

  // A piece in one run: at least `least` bytes (a multiple of `unit`), at most `most`, whole units. Empty where there
  // is no room now. least <= size().
  struct Piece {
    std::uint64_t offset = 0, bytes = 0;
  };
  Piece take(std::uint64_t least, std::uint64_t most, std::uint64_t unit);

  std::uint64_t head() const { return head_; }  // where the next piece begins, or later
  // All that was taken up to this head is free again.
  void release(std::uint64_t head) { tail_ = std::max(tail_, head); }
  std::uint64_t size() const { return size_; }

 private:
  std::uint64_t size_;
  std::uint64_t head_ = 0, tail_ = 0;
};

// Where the batches that are on their way end in the ring. Batch n may be closed once batch n - kBatches is executed.
class RingEnds {
 public:
  static constexpr std::uint64_t kBatches = 8;

  void close(std::uint64_t batch, const RingSpace& space) { ends_[batch % ends_.size()] = space.head(); }
  void executed(std::uint64_t batch, RingSpace& space) const {
    if (batch != 0) space.release(ends_[batch % ends_.size()]);
  }

 private:
  // The last one that was executed is looked up beside kBatches that are pending.
  std::array<std::uint64_t, 2 * kBatches> ends_{};
};

class StagingRing {
 public:
  // Pieces begin at multiples: what copies into images want.
  static constexpr std::uint64_t kAlign = 256;

  static Result<StagingRing> make(Device& device, std::uint64_t bytes);

  VkBuffer buffer() const { return buffer_.handle(); }
  std::span<std::byte> bytes(const RingSpace::Piece& piece) const {
    return buffer_.mapped().subspan(piece.offset, piece.bytes);
  }
  RingSpace space{0};
  RingEnds ends;

 private:
  Buffer buffer_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_STAGING_RING_H
