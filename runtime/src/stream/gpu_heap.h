// Device memory of resident frames: blocks, each with a buffer over it, out of which frames get ranges. What is
// allocated never exceeds the budget.
#ifndef BILLOW_RUNTIME_STREAM_GPU_HEAP_H
#define BILLOW_RUNTIME_STREAM_GPU_HEAP_H

#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "atlas.h"
#include "frame.h"
#include "stream/range_allocator.h"

namespace billow::runtime {

// One VkDeviceMemory.
struct HeapBlock {
  explicit HeapBlock(std::uint64_t bytes) : ranges(bytes) {}
  RangeAllocator ranges;
  bool images = false;   // of a memory type that buffers do not take
  bool leaving = false;  // gets no more frames: the budget shrank
  std::uint64_t allocated = 0;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  VkBuffer buffer = VK_NULL_HANDLE;  // over all of it
  VkDeviceAddress address = 0;
};

class GpuHeap;

// What one frame has of it.
class HeapMemory final : public FrameMemory {
 public:
  struct Part {
    HeapBlock* block = nullptr;
    std::uint64_t offset = 0, bytes = 0;
  };
  explicit HeapMemory(GpuHeap& heap) : heap_(heap) {}
  ~HeapMemory() override;

  VkBuffer bufferHandle() const { return buffer.block->buffer; }
  VkDeviceAddress address() const { return buffer.block->address + buffer.offset; }
  std::uint64_t bytes() const { return buffer.bytes + atlas.bytes; }

  Part buffer, atlas;  // without a block where the frame has none
  VkImage image = VK_NULL_HANDLE;
  VkImageView view = VK_NULL_HANDLE;
  std::uint64_t batch = 0;  // the last one of the Uploader that writes it

 private:
  GpuHeap& heap_;
};

// Thread-safe.
class GpuHeap {
 public:
  GpuHeap(Device& device, std::uint64_t budget) : device_(device), budget_(budget) {}
  GpuHeap(const GpuHeap&) = delete;
  GpuHeap& operator=(const GpuHeap&) = delete;
  ~GpuHeap();  // no HeapMemory may be left

  Result<void> create();

  // Device bytes that such a frame takes of a block.
  Result<std::uint64_t> need(std::uint64_t bufferBytes, const AtlasShape& shape);
  // Null where no block has room now, and the budget none for another. Errors: budget where the frame alone is too
  // large, memory where the device has none left, vulkan.
  Result<std::unique_ptr<HeapMemory>> allocate(std::uint64_t bufferBytes, const AtlasShape& shape);

  void setBudget(std::uint64_t bytes);
  // Whether the block in which the frame lies is to be given back, once all frames of it are gone.
  bool leaving(const HeapMemory& memory) const;

  std::uint64_t allocated() const { return allocated_; }
  std::uint64_t used() const { return used_; }
  std::uint64_t peak() const { return peak_; }

 private:
  friend class HeapMemory;
  using Part = HeapMemory::Part;

  Result<VkImage> makeImage(const AtlasShape& shape);
  Result<VkMemoryRequirements> imageNeeds(const AtlasShape& shape);
  Result<void> bindImage(const AtlasShape& shape, HeapMemory& memory);
  std::uint64_t aligned(std::uint64_t bytes) const { return (bytes + granule_ - 1) / granule_ * granule_; }
  // With mutex_ held; a Part without a block where there is no room.
  Result<Part> take(std::uint64_t bytes, std::uint64_t alignment, bool image);
  Part takeOfBlocks(std::uint64_t bytes, std::uint64_t alignment, bool image);
  std::uint64_t newBlockBytes(std::uint64_t bytes);
  Result<HeapBlock*> addBlock(std::uint64_t bytes, bool image);
  Result<void> fillBlock(HeapBlock& block, std::uint64_t bytes);
  void release(const Part& part);
  void destroy(HeapBlock& block);
  void dropEmpty(bool all);
  void chooseLeaving();

  Device& device_;
  mutable std::mutex mutex_;
  std::uint64_t budget_;
  std::uint64_t granule_ = 256;  // all offsets and sizes are multiples, so that buffers and images may be neighbours
  std::uint32_t bufferType_ = 0, imageType_ = 0;  // memory types
  // The device had no memory for another block: tries to leave out, unless one is given back or the budget set.
  std::uint32_t exhausted_ = 0;
  std::vector<std::unique_ptr<HeapBlock>> blocks_;
  std::map<std::array<std::uint32_t, 3>, VkMemoryRequirements> imageNeeds_;  // by shape
  std::atomic<std::uint64_t> allocated_ = 0, used_ = 0, peak_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_GPU_HEAP_H
