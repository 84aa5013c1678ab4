// Ranges of one block of memory: the best fit is taken, and neighbours that are free become one.
#ifndef BILLOW_RUNTIME_STREAM_RANGE_ALLOCATOR_H
#define BILLOW_RUNTIME_STREAM_RANGE_ALLOCATOR_H

#include <cstdint>
#include <optional>
#include <vector>

namespace billow::runtime {

class RangeAllocator {
 public:
  explicit RangeAllocator(std::uint64_t size) : size_(size) {
    if (size != 0) free_.push_back({0, size});
  }

  // Where `bytes` (> 0) at a multiple of `alignment` (> 0) begin; nullopt where no free range holds them.
  std::optional<std::uint64_t> allocate(std::uint64_t bytes, std::uint64_t alignment);
  // What allocate() gave for so many bytes. Allocates nothing.
  void release(std::uint64_t offset, std::uint64_t bytes);

  // Bytes of the free range that allocate() would take, or nullopt.
  std::optional<std::uint64_t> fit(std::uint64_t bytes, std::uint64_t alignment) const;
  std::uint64_t size() const { return size_; }
  std::uint64_t used() const { return used_; }
  std::uint64_t largest() const;

 private:
  struct Range {
    std::uint64_t offset, bytes;
  };
  std::optional<std::size_t> find(std::uint64_t bytes, std::uint64_t alignment) const;

  std::uint64_t size_;
  std::uint64_t used_ = 0;
  std::size_t taken_ = 0;    // ranges that are not free
  std::vector<Range> free_;  // ascending, none touches the next
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_RANGE_ALLOCATOR_H
