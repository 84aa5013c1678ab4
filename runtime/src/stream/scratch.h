// One block of memory, handed out from its beginning, over and over.
#ifndef BILLOW_RUNTIME_STREAM_SCRATCH_H
#define BILLOW_RUNTIME_STREAM_SCRATCH_H

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory_resource>
#include <span>

namespace billow::runtime {

inline constexpr std::uint64_t kScratchAlign = 64;

constexpr std::uint64_t scratchBytes(std::uint64_t bytes) {
  return (bytes + kScratchAlign - 1) / kScratchAlign * kScratchAlign;
}

class Scratch {
 public:
  explicit Scratch(std::pmr::memory_resource* memory) : memory_(memory) {}
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() { release(); }

  // Takes back all that was handed out. Afterwards `bytes` can be, each piece rounded up by scratchBytes(). Throws
  // std::bad_alloc, and then holds nothing.
  void reset(std::uint64_t bytes) {
    used_ = 0;
    if (bytes <= size_) return;
    release();
    block_ = static_cast<std::byte*>(memory_->allocate(bytes, kScratchAlign));
    size_ = bytes;
  }

  // Not cleared. More than reset() was told of is our own fault.
  template <class T>
  std::span<T> take(std::uint64_t count) {
    const std::uint64_t bytes = scratchBytes(count * sizeof(T));
    if (bytes > size_ - used_) std::abort();
    T* const first = reinterpret_cast<T*>(block_ + used_);
    used_ += bytes;
    return {first, count};
  }

 private:
  void release() {
    if (block_ != nullptr) memory_->deallocate(block_, size_, kScratchAlign);
    block_ = nullptr;
    size_ = 0;
  }

  std::pmr::memory_resource* memory_;
  std::byte* block_ = nullptr;
  std::uint64_t size_ = 0, used_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_SCRATCH_H
