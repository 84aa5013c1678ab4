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

// Where bricks lie on the GPU: BC7 and R8 in atlases, BC4 in a buffer whose blocks the shader decodes, for devices
// differ by up to three steps of 255 in what their samplers make of BC4.
enum class BrickStore : std::uint32_t { bc7 = 0, r8 = 1, bc4 = 2 };
inline constexpr std::uint32_t kStoreCount = 3;
inline constexpr std::uint32_t kAtlasCount = 2;  // the first ones
inline constexpr std::uint32_t kStoreSlotBytes[kStoreCount] = {128, 512, 256};

BrickStore storeOf(std::uint32_t encoding);

struct StoredBrick {
  std::span<const std::byte> bytes;  // in the pack's encoding; lives as long as its GridView
  std::uint32_t encoding;
  std::uint32_t slot;
};

// Gives bricks slots; what is equal in the pack (same unit) gets one slot, whichever grid asks.
class BrickSlots {
 public:
  // Bricks of a kind that the device does not take are decoded to R8.
  BrickSlots(bool bc7, bool bc4) : bc7_(bc7), bc4_(bc4) {}

  // The record's brick word: encoding on the GPU << kEncodingShift | slot.
  std::uint32_t place(const format::GridView::Leaf& leaf);

  std::span<const StoredBrick> bricks(BrickStore which) const { return bricks_[static_cast<std::uint32_t>(which)]; }
  std::uint32_t slots(BrickStore which) const { return slots_[static_cast<std::uint32_t>(which)]; }

 private:
  bool bc7_, bc4_;
  std::vector<StoredBrick> bricks_[kStoreCount];
  std::uint32_t slots_[kStoreCount] = {};
  std::unordered_map<std::uint32_t, std::uint32_t> placed_;  // the pack's brick word -> ours
};

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
