// How much a load needs, and where it puts what: told by the tables, before any page is looked at.
#ifndef BILLOW_RUNTIME_STREAM_LOAD_PLAN_H
#define BILLOW_RUNTIME_STREAM_LOAD_PLAN_H

#include "stream/load_frame.h"

namespace billow::runtime {

// A slot of 32 bytes never lies in two sectors of a cache.
inline constexpr std::uint64_t kSectionAlign = format::kBrickUnitBytes;

// An array in the frame's buffer.
struct Section {
  std::uint64_t at = 0;     // bytes
  std::uint64_t count = 0;  // items that fit
};

struct GridPlan {
  const format::GridFrame* frame = nullptr;  // null where the frame has no such grid
  std::uint32_t number = format::kNone;      // within the volume
  format::CellBox cells{};
  Index index = Index::flat;
  Section table, records, node4, children;         // without items where nothing is active
  std::uint64_t tileSlots = 0;                     // of a RecordTable
  std::uint64_t masks = 0, blocks = 0, units = 0;  // at most: masks, BC7 bricks, units of others
};

struct LoadPlan {
  std::array<GridPlan, gpu::kGridSlots> grids;
  std::array<std::uint64_t, format::kStreamCount> items{};  // of all pages
  std::uint64_t contentBytes = 0;                           // of all pages, each rounded up by scratchBytes()
  std::uint64_t distanceBytes = 0;                          // scratch of the largest DistanceField
  std::uint64_t tileSlots = 0;                              // the most of a grid
  std::uint64_t means = 0;                                  // scratch of a MeansBuilder, items
  Section bricks;                                           // units; in the buffer, behind what grids have of their own
  Section masks;  // last in the buffer, so that a shader that reads a word past the last brick stays inside
  std::uint64_t bufferBytes = 0;
  bool inAtlas = false;  // BC7 bricks stay blocks
  AtlasShape shape;
  std::uint64_t scratch = 0;  // bytes, all of them
};

// Grid numbers by slot.
std::array<std::uint32_t, gpu::kGridSlots> gridsBySlot(const GridChoice& choice);

// Whether the grid frame has a tree.
bool isPresent(const format::GridFrame& frame);

// The index that the grid will have: the frame's record alone says which.
Index chooseIndex(const format::GridFrame& frame, Index wanted);

// `pages` are those of pagesOf(); their bytes are not looked at.
Result<LoadPlan> planLoad(const LoadRequest& request, std::span<const StoredPage> pages);

// Where an error about a grid lies: its record, with volume, frame and grid.
format::Place gridPlace(const LoadRequest& request, std::uint32_t grid);
tl::unexpected<Error> packError(const format::Issue& issue);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_LOAD_PLAN_H
