#include "stream/range_allocator.h"

#include <algorithm>

namespace billow::runtime {
namespace {

std::uint64_t padding(std::uint64_t offset, std::uint64_t alignment) {
  const std::uint64_t over = offset % alignment;
  return over == 0 ? 0 : alignment - over;
}

}  // namespace

std::optional<std::size_t> RangeAllocator::find(std::uint64_t bytes, std::uint64_t alignment) const {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    const std::uint64_t before = padding(free_[i].offset, alignment);
    if (before > free_[i].bytes || bytes > free_[i].bytes - before) continue;
    if (!best || free_[i].bytes < free_[*best].bytes) best = i;
  }
  return best;
}

std::optional<std::uint64_t> RangeAllocator::fit(std::uint64_t bytes, std::uint64_t alignment) const {
  const auto found = find(bytes, alignment);
  return found ? std::optional(free_[*found].bytes) : std::nullopt;
}

std::uint64_t RangeAllocator::largest() const {
  std::uint64_t most = 0;
  for (const Range& range : free_) most = std::max(most, range.bytes);
  return most;
}

std::optional<std::uint64_t> RangeAllocator::allocate(std::uint64_t bytes, std::uint64_t alignment) {
  const auto found = find(bytes, alignment);
  if (!found) return std::nullopt;
  // Between n taken ranges lie n + 1 free ones at most, so that release() needs no memory.
  free_.reserve(taken_ + 2);
  const auto place = free_.begin() + static_cast<std::ptrdiff_t>(*found);
  const Range range = *place;
  const std::uint64_t before = padding(range.offset, alignment);
  const std::uint64_t after = range.bytes - before - bytes;
  const std::uint64_t offset = range.offset + before;
  if (before != 0 && after != 0) {
    place->bytes = before;
    free_.insert(place + 1, {offset + bytes, after});
  } else if (before != 0) {
    place->bytes = before;
  } else if (after != 0) {
    *place = {offset + bytes, after};
  } else {
    free_.erase(place);
  }
  ++taken_;
  used_ += bytes;
  return offset;
}

void RangeAllocator::release(std::uint64_t offset, std::uint64_t bytes) {
  const auto next = std::upper_bound(free_.begin(), free_.end(), offset,
                                     [](std::uint64_t at, const Range& range) { return at < range.offset; });
  const bool joinsBefore = next != free_.begin() && (next - 1)->offset + (next - 1)->bytes == offset;
  const bool joinsAfter = next != free_.end() && offset + bytes == next->offset;
  if (joinsBefore && joinsAfter) {
    (next - 1)->bytes += bytes + next->bytes;
    free_.erase(next);
  } else if (joinsBefore) {
    (next - 1)->bytes += bytes;
  } else if (joinsAfter) {
    *next = {offset, bytes + next->bytes};
  } else {
    free_.insert(next, {offset, bytes});
  }
  --taken_;
  used_ -= bytes;
}

}  // namespace billow::runtime
