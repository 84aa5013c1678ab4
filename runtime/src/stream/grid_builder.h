// One grid's tree to what the GPU walks: an index over cells of 8^3 voxels, records, masks.
#ifndef BILLOW_RUNTIME_STREAM_GRID_BUILDER_H
#define BILLOW_RUNTIME_STREAM_GRID_BUILDER_H

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "billow/format/gpu_size.h"
#include "billow/format/issue.h"
#include "billow/format/rule.h"
#include "stream/brick_places.h"
#include "stream/load_plan.h"
#include "stream/page_items.h"

namespace billow::runtime {

// What the GPU reads of a Node3 or of an active tile, in one load. An inactive voxel's value is the grid's background.
struct GpuRecord {
  std::uint32_t brick;  // encoding on the GPU << kEncodingShift | slot
  std::uint32_t mask;   // number of a mask, kMaskAll or kMaskTexel
  float lo;
  float scale;
};
static_assert(sizeof(GpuRecord) == format::kGpuRecordBytes);

// Masks of all grids of a frame, each distinct one once.
struct MaskTable {
  std::span<std::uint32_t> numbers;  // by mask of the pages: number + 1, or 0
  std::span<format::Mask3> masks;
  std::uint32_t used = 0;
};

// By item of the pages; cleared for each grid.
struct GridScratch {
  std::span<std::uint32_t> records;   // of Node3s, 0 where it was not met
  std::span<std::uint32_t> lists;     // of Node4s: where its child list begins on the GPU + 1
  std::span<std::uint32_t> tiles;     // hash table of tiles' records, 0 where it is free
  std::span<std::uint8_t> distances;  // for a DistanceField
};

class GridBuilder {
 public:
  GridBuilder(const LoadRequest& request, const GridPlan& grid, PageItems& items, BrickPlaces& bricks, MaskTable& masks,
              const GridScratch& scratch, std::span<std::byte> buffer);

  // Fills the grid's sections of the buffer; else issue() says what is wrong.
  bool build();
  format::Issue& issue() { return *issue_; }
  std::uint32_t absent5() const { return absent5_; }

 private:
  struct Parent {  // the node that refers to what is looked for
    const char* kind;
    std::uint64_t index;
    std::uint32_t page;
  };
  struct Children {
    std::uint32_t count = 0;
    const std::uint32_t* list = nullptr;  // null without children
  };

  bool fail(format::Rule rule, const Parent& at, std::string detail);
  bool failMissing(format::Stream stream, const Parent& at, const char* kind, std::uint64_t index);
  template <class Node>
  bool checkNode(const Node& node, const Parent& at, Children& children);

  bool walk(const format::Node5& root, const Parent& at, const Children& children);
  bool addNode4(std::uint32_t bit, std::uint32_t place, const Parent& parent, std::uint32_t index);
  bool addToCells(const format::Node4& node, std::uint32_t bit, std::uint32_t absent, const Parent& at,
                  const Children& children);
  bool addToTree(const format::Node4& node, std::uint32_t place, std::uint32_t absent, std::uint32_t local,
                 const Parent& at, const Children& children);
  bool addToDense(const format::Node4& node, std::uint32_t place, std::uint32_t absent, const Parent& at,
                  const Children& children);
  void fillCells(std::uint32_t bit, std::uint32_t record);
  void beginTree(const format::Node5& root);

  // A record's number, or 0 where it failed.
  std::uint32_t record(std::uint32_t index, const Parent& parent) {
    const PageItems::Found found = items_.find(format::Stream::node3, index, 1);
    if (found.data == nullptr) return failMissing(format::Stream::node3, parent, "Node3", index), 0;
    const std::uint32_t known = scratch_.records[found.local];
    return known != 0 ? known : addRecord(index, found);
  }
  std::uint32_t addRecord(std::uint32_t index, const PageItems::Found& found);
  bool maskWord(const format::Node3& node, const Parent& at, std::uint32_t& word);
  bool brickWord(const format::Node3& node, const Parent& at, std::uint32_t& word);
  bool checkValues(const format::Node3& node, const Parent& at);
  // The record of an active tile; 0 where the value is the background's.
  bool tile(float value, const Parent& at, std::uint32_t& number);

  template <class T>
  std::span<T> section(const Section& section) const {
    return {reinterpret_cast<T*>(buffer_.data() + section.at), section.count};
  }

  const LoadRequest& request_;
  const GridPlan& grid_;
  PageItems& items_;
  BrickPlaces& bricks_;
  MaskTable& masks_;
  const GridScratch& scratch_;
  std::span<std::byte> buffer_;
  std::span<std::uint32_t> table_, node4_, children_;
  std::span<GpuRecord> records_;
  std::uint32_t recordsUsed_ = 0, tilesUsed_ = 0, childrenUsed_ = 0, absent5_ = 0;
  std::uint64_t leaves_ = 0;
  std::optional<format::Issue> issue_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_GRID_BUILDER_H
