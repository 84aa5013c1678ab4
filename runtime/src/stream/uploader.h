// Copies from the CPU into resident frames: pieces through the staging ring, recorded in batches, each one command
// buffer and one submission. Batch n signals the value n of the timeline semaphore.
//
// copy() and close() are called by one thread at a time, submit() by another one at the same time, all else by any.
#ifndef BILLOW_RUNTIME_STREAM_UPLOADER_H
#define BILLOW_RUNTIME_STREAM_UPLOADER_H

#include <array>
#include <atomic>

#include "stream/gpu_heap.h"
#include "stream/jobs.h"
#include "stream/staging_ring.h"

namespace billow::runtime {

// One frame's bytes on their way.
struct Upload {
  std::span<const std::byte> buffer, atlas;  // stay until copied
  AtlasShape shape;
  const HeapMemory* target = nullptr;
  std::uint64_t bufferDone = 0;  // bytes
  std::uint64_t atlasDone = 0;   // units of Uploader::AtlasUnit
  bool begun = false;
  bool copied = false;
  std::uint64_t batch = 0;  // the last one that has a piece of it
};

class Uploader {
 public:
  // `closed` is called by whoever copies, when a batch waits to be submitted.
  Uploader(Device& device, const Job& closed) : device_(device), closedCall_(closed) {}
  Uploader(const Uploader&) = delete;
  Uploader& operator=(const Uploader&) = delete;
  ~Uploader();

  Result<void> create(std::uint64_t stagingBytes);

  // As much as ring and command buffers take now. Where all of it is recorded, `copied` is set. Errors: unsupported
  // where the ring is too small for the least piece of an atlas, vulkan.
  Result<void> copy(Upload& upload);
  // What was recorded may be submitted.
  Result<void> close();

  // Submits what was closed. Never waits.
  Result<void> submit();
  bool wantsSubmit() const { return closed_ > submitted_; }

  // Waits for what was submitted, for some seconds at most: a device that hangs is given up on.
  void finish();
  // What copy() last saw of completed(): where it ended early and this is outdated, it may go on.
  std::uint64_t seen() const { return seen_; }
  // The last batch that the device has executed and that nobody is still submitting. Errors: vulkan.
  Result<std::uint64_t> completed() const;
  std::uint64_t closed() const { return closed_; }
  std::uint64_t submitted() const { return submitted_; }
  VkSemaphore semaphore() const { return semaphore_; }
  // The atlas of frames that have none: one texel.
  VkImageView emptyAtlas() const { return emptyAtlas_.view(); }
  std::uint64_t bytesUploaded() const { return bytesUploaded_; }

 private:
  static constexpr std::uint64_t kBatches = RingEnds::kBatches;  // command buffers

  // The least part of an atlas that one copy may have on the queue: a row of blocks, or slices.
  struct AtlasUnit {
    std::uint64_t bytes = 0;
    std::uint32_t rows = 0;  // of blocks in a slice; 0 where a unit is `slices` whole ones
    std::uint32_t slices = 0;
  };

  Result<void> createCommands();
  AtlasUnit unitOf(const AtlasShape& shape) const;
  Result<bool> room();  // open(), after the batch that is full was closed
  Result<bool> open();  // false where all command buffers are in use
  Result<bool> copyBuffer(Upload& upload);
  Result<bool> copyAtlas(Upload& upload);
  void recordAtlas(const Upload& upload, const AtlasUnit& unit, std::uint64_t ringOffset, std::uint64_t units);
  RingSpace::Piece take(std::uint64_t least, std::uint64_t most, std::uint64_t unit);

  Device& device_;
  const Job closedCall_;
  StagingRing ring_;
  Image emptyAtlas_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkSemaphore semaphore_ = VK_NULL_HANDLE;
  std::array<VkCommandBuffer, kBatches> commands_{};
  VkCommandBuffer recording_ = VK_NULL_HANDLE;
  std::uint64_t recordedBytes_ = 0;
  bool emptyReady_ = false;
  std::atomic<std::uint64_t> closed_ = 0, submitted_ = 0, seen_ = 0;
  std::atomic<std::uint64_t> bytesUploaded_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_UPLOADER_H
