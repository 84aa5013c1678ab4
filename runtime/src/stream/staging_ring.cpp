#include "stream/staging_ring.h"

#include "debug.h"

namespace billow::runtime {

RingSpace::Piece RingSpace::take(std::uint64_t least, std::uint64_t most, std::uint64_t unit) {
  const auto up = [](std::uint64_t at, std::uint64_t to) { return (at + to - 1) / to * to; };
  if (head_ == tail_) head_ = tail_ = up(head_, size_);  // nothing is in use: all of it in one run
  std::uint64_t at = up(head_, StagingRing::kAlign);
  // What is left of this turn may be too little; the next one begins at 0.
  if (size_ - at % size_ < least) at += size_ - at % size_;
  if (at - tail_ > size_) return {};
  const std::uint64_t room = std::min(size_ - at % size_, size_ - (at - tail_));
  const std::uint64_t bytes = std::min(room, most) / unit * unit;
  if (bytes < least) return {};
  head_ = at + bytes;
  return {at % size_, bytes};
}

Result<StagingRing> StagingRing::make(Device& device, std::uint64_t bytes) {
  const std::uint64_t size = bytes / kAlign * kAlign;
  StagingRing ring;
  auto buffer = Buffer::make(device, "billow staging ring", size, VK_BUFFER_USAGE_TRANSFER_SRC_BIT);
  if (!buffer) return tl::unexpected(buffer.error());
  ring.buffer_ = std::move(*buffer);
  if (auto bound = ring.buffer_.bind(Placement::mapped); !bound) return tl::unexpected(bound.error());
  ring.space = RingSpace(size);
  return ring;
}

}  // namespace billow::runtime
