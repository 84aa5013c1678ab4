// The memory of streaming: every byte is counted against the budget, and refused beyond it.
#ifndef BILLOW_RUNTIME_STREAM_COUNTED_MEMORY_H
#define BILLOW_RUNTIME_STREAM_COUNTED_MEMORY_H

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory_resource>

#include "billow/runtime/stream.h"

namespace billow::runtime {

// Thread-safe. What it hands out comes from the host's Allocator, or from the C++ heap.
class CountedMemory final : public std::pmr::memory_resource {
 public:
  CountedMemory(const Allocator& allocator, std::uint64_t budget) : allocator_(allocator), budget_(budget) {}

  // Counts bytes that lie elsewhere; false, and nothing is counted, where they do not fit.
  bool reserve(std::uint64_t bytes);
  void release(std::uint64_t bytes) { used_ -= bytes; }

  // May be less than what is used: then everything is refused until enough was given back.
  void setBudget(std::uint64_t bytes) { budget_ = bytes; }
  std::uint64_t budget() const { return budget_; }
  std::uint64_t used() const { return used_; }
  std::uint64_t peak() const { return peak_; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;  // throws std::bad_alloc
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override;
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override { return this == &other; }

  const Allocator allocator_;
  std::atomic<std::uint64_t> budget_;
  std::atomic<std::uint64_t> used_ = 0;
  std::atomic<std::uint64_t> peak_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_COUNTED_MEMORY_H
