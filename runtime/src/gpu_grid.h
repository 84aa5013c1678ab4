// From a checked grid to what the GPU walks: an index over cells of 8^3 voxels, records, masks, and distinct bricks.
#ifndef BILLOW_RUNTIME_GPU_GRID_H
#define BILLOW_RUNTIME_GPU_GRID_H

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "billow/format/gpu_size.h"
#include "billow/format/grid_view.h"
#include "billow/runtime/runtime.h"

namespace billow::runtime {

inline constexpr std::uint32_t kAtlasSlotBytes = 128;

struct StoredBrick {
  std::span<const std::byte> bytes;  // in the pack's encoding; lives as long as its GridView
  std::uint32_t encoding;
  std::uint32_t slot;  // the first one
};

// Gives bricks slots; what is equal in the pack (same brick word) gets one place, whichever grid asks. BC7 bricks lie
// in the atlas, one a slot. All others lie in a buffer as they lie on disk, one after another, whose slots are units of
// kBrickUnitBytes; the shader decodes them. Where the device does not take BC7, such bricks are decoded to eight bits a
// voxel and lie there too.
class BrickSlots {
 public:
  explicit BrickSlots(bool bc7) : bc7_(bc7) {}

  // The record's brick word: encoding on the GPU << kEncodingShift | slot.
  std::uint32_t place(const format::GridView::Leaf& leaf);

  std::span<const StoredBrick> inAtlas() const { return inAtlas_; }
  std::span<const StoredBrick> inBuffer() const { return inBuffer_; }
  // Slots of the buffer. Only where they are at most kBrickUnitMask are the words right that place() gave.
  std::uint64_t bufferSlots() const { return bufferSlots_; }

 private:
  bool bc7_;
  std::vector<StoredBrick> inAtlas_;
  std::vector<StoredBrick> inBuffer_;
  std::uint64_t bufferSlots_ = 0;
  std::unordered_map<std::uint32_t, std::uint32_t> placed_;  // the pack's brick word -> ours
};

// Writes a brick of the buffer, as it lies on disk or decoded, at its slot of the buffer's bytes.
void writeBrick(const StoredBrick& brick, std::span<std::byte> buffer);

// What the GPU reads of a Node3 or of an active tile, in one load. An inactive voxel's value is the grid's background.
struct GpuRecord {
  std::uint32_t brick;  // encoding on the GPU << kEncodingShift | slot
  std::uint32_t mask;   // number in GpuGrid::masks, kMaskAll or kMaskTexel
  float lo;
  float scale;
};
static_assert(sizeof(GpuRecord) == format::kGpuRecordBytes);

// One grid as arrays, ready to be copied. Layouts: shaders/interface.h.
struct GpuGrid {
  format::GridFrame frame{};
  format::CellBox cells{};
  Index index = Index::flat;
  std::vector<std::uint32_t> table;     // flat: an entry a cell; tree: Node5 words; dense: Node4 number + 1 a child
  std::vector<std::uint32_t> node4;     // tree: Node4 words; dense: a record a child
  std::vector<std::uint32_t> children;  // tree: records
  std::vector<GpuRecord> records;       // number - 1
  std::vector<format::Mask3> masks;
  std::uint32_t absent5 = 0;  // tree, dense: record where Node5 has no child
  bool skippable = true;      // background 0: what is absent contributes nothing
  std::uint64_t indexBytes() const { return 4 * (table.size() + node4.size() + children.size()); }
};

// The index that buildGpuGrid() will use: the frame's record alone says which.
Index chooseIndex(const format::GridFrame& frame, Index wanted);
GpuGrid buildGpuGrid(const format::GridView& view, Index wanted, BrickSlots& slots);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_GPU_GRID_H
