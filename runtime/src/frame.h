// A resident frame and how it gets there.
#ifndef BILLOW_RUNTIME_FRAME_H
#define BILLOW_RUNTIME_FRAME_H

#include <array>
#include <optional>
#include <vector>

#include "atlas.h"
#include "gpu_grid.h"
#include "interface.h"
#include "memory.h"

namespace billow::runtime {

// One grid's part of a resident frame, ready to be written into GridParams.
struct ResidentGrid {
  bool present = false;
  format::GridFrame frame{};
  format::CellBox cells{};
  Index index = Index::flat;
  std::uint32_t absent5 = 0;
  bool skippable = true;
  VkDeviceAddress table = 0, records = 0, masks = 0, node4 = 0, children = 0;
};

// By slot: the index of each grid that the frame has; pipelines are made for it.
using FrameIndices = std::array<std::optional<Index>, gpu::kGridSlots>;

class ResidentFrame final : public Frame {
 public:
  const FrameStats& stats() const override { return stats_; }
  std::uint64_t uploadValue() const override { return uploadValue_; }
  bool empty() const override;
  FrameIndices indices() const;

  FrameStats stats_;
  std::uint64_t uploadValue_ = 0;
  std::array<ResidentGrid, gpu::kGridSlots> grids_;
  // Bricks that are not BC7, then tables, records and masks of all grids: a shader that reads a word past the last
  // brick stays inside.
  Buffer buffer_;
  std::uint64_t bufferBytes_ = 0;  // of it that are copied from staging
  VkDeviceAddress bricks_ = 0;     // where buffer_ begins
  Image atlas_;
  AtlasShape shape_;
};

// A frame on the CPU: what will be copied, with the views that its bricks point into.
struct StagedFrame {
  std::vector<format::GridView> views;
  std::array<std::optional<GpuGrid>, gpu::kGridSlots> grids;
  AtlasShape shape;
  BrickSlots slots;
  std::uint64_t bufferBytes = 0;
};

// What indices() will be of the frame once it is resident. Reads no page.
Result<FrameIndices> frameIndices(const format::Pack& pack, const format::VolumeRecord& volume, std::uint32_t frame,
                                  const UploadOptions& options);

// Loads and checks the grids, builds indices and gives out slots. Allocates nothing on the device.
Result<StagedFrame> stageFrame(const Device& device, const format::Pack& pack, std::uint32_t volume,
                               std::uint32_t frame, const UploadOptions& options);

// Creates the frame's objects and its staging buffer, checks them against the budget, then allocates and fills the
// staging memory: the buffer's bytes, and from `atlasOffset` on the atlas's.
struct FrameObjects {
  std::unique_ptr<ResidentFrame> frame;
  Buffer staging;
  std::uint64_t atlasOffset = 0;
};
Result<FrameObjects> makeFrameObjects(Device& device, const StagedFrame& staged);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_FRAME_H
