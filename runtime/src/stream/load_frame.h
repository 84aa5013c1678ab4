// From the stored pages of a frame to the bytes that the GPU reads of it: one pass over the tree, no Vulkan device.
//
// Nothing in a page is trusted. Checked is all that bounds what CPU or GPU read or write: that nodes, child lists,
// masks and bricks exist and lie in the pages at hand, that encodings are known, that no count exceeds what the tables
// promised, that `lo`, `scale` and tiles are finite. Not checked is what only costs quality: `min`, `max` and `mean` of
// nodes, active voxels outside of the active box, bricks that overlap in part, tiles of inactive nodes (they are taken
// to be the background). format::validate() knows all of it.
#ifndef BILLOW_RUNTIME_STREAM_LOAD_FRAME_H
#define BILLOW_RUNTIME_STREAM_LOAD_FRAME_H

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "atlas.h"
#include "billow/format/page_unpacker.h"
#include "billow/runtime/stream.h"
#include "interface.h"
#include "stream/scratch.h"

namespace billow::runtime {

// An image is rounded up to 64 KiB and more, and is one more allocation. So many BC7 bricks fill 64 KiB where they are
// decoded to 512 bytes each.
inline constexpr std::uint32_t kLeastAtlasBricks = 128;

struct LoadRequest {
  const format::Pack* pack = nullptr;
  std::uint32_t volume = 0, frame = 0;  // in range
  GridChoice grids = {};                // numbers of the volume, or kNone
  Index index = Index::automatic;
  // In place of the grids their means of 8^3 voxels each, with a flat index: little memory, and pages are read all the
  // same. Optical depth is that of the grids.
  bool means = false;
  bool bc7 = false;                                    // BC7 bricks stay blocks, in an image
  std::uint32_t leastAtlasBricks = kLeastAtlasBricks;  // where there are fewer, they are decoded all the same
  std::uint32_t maxImageExtent3D = 0;                  // of the device; read with bc7
  Verify verify = Verify::always;
  // A bit a page of the pack, set where it was found whole; shared by all who load of it. Without it `once` is always.
  std::span<std::atomic<std::uint32_t>> verified = {};
};

// Bytes that nothing changes while they are loaded. Pages stored raw are not copied where they lie at a multiple of 4.
struct StoredPage {
  std::uint32_t number = 0;
  std::span<const std::byte> bytes;
};

// One grid's part of a frame. Where its arrays lie is told in bytes from the beginning of the frame's buffer.
struct LoadedGrid {
  bool present = false;
  format::GridFrame frame{};
  format::CellBox cells{};
  Index index = Index::flat;
  std::uint32_t absent5 = 0;
  bool skippable = true;
  std::uint64_t table = 0, records = 0, masks = 0, node4 = 0, children = 0;
};

struct LoadedFrame {
  std::array<LoadedGrid, gpu::kGridSlots> grids;
  AtlasShape shape;                   // without slots where no brick is BC7 on the GPU
  std::span<const std::byte> buffer;  // all of the frame's buffer; empty where nothing is active
  std::span<const std::byte> atlas;   // tightly packed, shape.bytes() where the shape has slots
  FrameStats stats;                   // without allocatedBytes
};

// Numbers of the pages that the chosen grids need, ascending, each once. The request must be in range.
std::vector<std::uint32_t> pagesOf(const LoadRequest& request);

// The most bytes of its memory that a FrameLoader holds which made no larger load before, known from the tables alone.
// 0 where they contradict themselves: load() then says how.
std::uint64_t scratchBound(const LoadRequest& request);

// One for each thread that loads.
class FrameLoader {
 public:
  // Scratch memory comes from `memory`, in one block that is kept from load to load and grows.
  explicit FrameLoader(std::pmr::memory_resource* memory);

  // `stored` are the pages of pagesOf(), in that order, as they lie in the file; any bytes are allowed. What the result
  // points to stays until the next call. Errors: argument (volume, frame, grids or pages are not there), pack (with the
  // issue, which names the page), unsupported (too large for the device or for 4 GiB of bricks), memory (also where
  // `memory` throws std::bad_alloc).
  Result<LoadedFrame> load(const LoadRequest& request, std::span<const StoredPage> stored);

 private:
  Scratch scratch_;
  format::PageUnpacker unpacker_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_LOAD_FRAME_H
