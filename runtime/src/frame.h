// A resident frame and how it gets there.
#ifndef BILLOW_RUNTIME_FRAME_H
#define BILLOW_RUNTIME_FRAME_H

#include <array>
#include <memory>
#include <optional>

#include "atlas.h"
#include "interface.h"
#include "memory.h"
#include "stream/load_frame.h"

namespace billow::runtime {

// One grid's part of a resident frame, ready to be written into GridParams: its arrays lie at addresses.
struct ResidentGrid : LoadedGrid {};

// By slot: the index of each grid that the frame has; pipelines are made for it.
using FrameIndices = std::array<std::optional<Index>, gpu::kGridSlots>;

// Without those of velocity grids: what a pipeline that carries nothing is made for.
FrameIndices matterOf(FrameIndices indices);

// What a frame's bytes lie in; given back when it is destroyed.
class FrameMemory {
 public:
  virtual ~FrameMemory() = default;
};

// A frame as draws read it, whoever owns its memory.
class ResidentFrame final : public Frame {
 public:
  const FrameStats& stats() const override { return stats_; }
  std::uint64_t uploadValue() const override { return uploadValue_; }
  bool empty() const override;
  FrameIndices indices() const;

  FrameStats stats_;
  std::uint64_t uploadValue_ = 0;
  std::uint64_t number_ = 0;  // no other frame's of this device: memory is given to one frame after another
  std::array<ResidentGrid, gpu::kGridSlots> grids_;
  VkDeviceAddress bricks_ = 0;  // where LoadedFrame::buffer begins
  VkImageView atlas_ = VK_NULL_HANDLE;
  AtlasShape shape_;
  std::unique_ptr<FrameMemory> memory_;
};

// Memory of one frame alone.
class OwnMemory final : public FrameMemory {
 public:
  Buffer buffer;
  Image atlas;
};

// What indices() will be of the frame once it is resident. Reads no page.
Result<FrameIndices> frameIndices(const format::Pack& pack, const format::VolumeRecord& volume, std::uint32_t frame,
                                  const UploadOptions& options);

// Reads the pages and loads them, by the device's limits. Allocates nothing on it.
Result<LoadedFrame> readFrame(const Device& device, const format::Pack& pack, std::uint32_t volume, std::uint32_t frame,
                              const UploadOptions& options, FrameLoader& loader);

// A loaded grid of a frame whose buffer begins at `buffer`.
ResidentGrid residentGrid(const LoadedGrid& grid, VkDeviceAddress buffer);

// Creates the frame's objects and its staging buffer, checks them against the budget, then allocates and fills the
// staging memory: the buffer's bytes, and from `atlasOffset` on the atlas's.
struct FrameObjects {
  std::unique_ptr<ResidentFrame> frame;
  OwnMemory* memory = nullptr;  // the frame's
  std::uint64_t bufferBytes = 0;
  Buffer staging;
  std::uint64_t atlasOffset = 0;
};
Result<FrameObjects> makeFrameObjects(Device& device, const LoadedFrame& loaded);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_FRAME_H
