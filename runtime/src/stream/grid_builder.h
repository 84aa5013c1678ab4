// One grid's tree to what the GPU walks: an index over cells of 8^3 voxels, records, masks.
#ifndef BILLOW_RUNTIME_STREAM_GRID_BUILDER_H
#define BILLOW_RUNTIME_STREAM_GRID_BUILDER_H

#include <cstdint>
#include <span>

#include "stream/brick_places.h"
#include "stream/record_table.h"
#include "stream/tree_walk.h"

namespace billow::runtime {

// Masks of all grids of a frame, each distinct one once.
struct MaskTable {
  std::span<std::uint32_t> numbers;  // by mask of the pages: number + 1, or 0
  std::span<format::Mask3> masks;
  std::uint32_t used = 0;
};

// Room for one grid after another.
struct GridScratch {
  std::span<std::uint32_t> records;   // by Node3 of the pages, 0 where it was not met
  std::span<std::uint32_t> lists;     // by Node4 of the pages: where its child list begins on the GPU + 1, or 0
  std::span<std::uint32_t> tiles;     // of a RecordTable
  std::span<std::uint8_t> distances;  // of a DistanceField
  std::span<float> means;             // of a MeansBuilder
};

// T items of a section of the frame's buffer.
template <class T>
std::span<T> itemsOf(std::span<std::byte> buffer, const Section& section) {
  return {reinterpret_cast<T*>(buffer.data() + section.at), section.count};
}

class GridBuilder {
 public:
  GridBuilder(TreeWalk& walk, const GridPlan& grid, BrickPlaces& bricks, MaskTable& masks, const GridScratch& scratch,
              std::span<std::byte> buffer);

  // Fills the grid's sections of the buffer; else the walk's issue says what is wrong.
  bool build();
  std::uint32_t absent5() const { return absent5_; }

 private:
  using Root = TreeWalk::Visited<format::Node5>;
  using Upper = TreeWalk::Visited<format::Node4>;

  bool walkRoot(const Root& root);
  bool beginIndex(const Root& root);
  bool addNode4(std::uint32_t bit, std::uint32_t place, const Upper& node);
  bool addToCells(std::uint32_t bit, std::uint32_t absent, const Upper& node);
  bool addToTree(std::uint32_t place, std::uint32_t absent, const Upper& node);
  bool addToDense(std::uint32_t place, std::uint32_t absent, const Upper& node);
  void fillCells(std::uint32_t bit, std::uint32_t record);

  // A record's number, or 0 where it failed.
  std::uint32_t record(std::uint32_t index, const TreeWalk::Node& parent) {
    const PageItems::Found found = walk_.node3(parent, index);
    if (found.data == nullptr) return 0;
    const std::uint32_t known = scratch_.records[found.local];
    return known != 0 ? known : addRecord(index, found);
  }
  std::uint32_t addRecord(std::uint32_t index, const PageItems::Found& found);
  bool checkValues(const format::Node3& node, const TreeWalk::Node& at);
  bool maskWord(const format::Node3& node, const TreeWalk::Node& at, std::uint32_t& word);
  bool brickWord(const format::Node3& node, const TreeWalk::Node& at, std::uint32_t& word);
  bool tile(float value, const TreeWalk::Node& at, std::uint32_t& number);

  TreeWalk& walk_;
  const GridPlan& grid_;
  BrickPlaces& bricks_;
  MaskTable& masks_;
  const GridScratch& scratch_;
  std::span<std::uint32_t> table_, node4_, children_;
  RecordTable records_;
  std::uint32_t childrenUsed_ = 0, absent5_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_GRID_BUILDER_H
