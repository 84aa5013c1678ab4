#include "stream/grid_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>

#include "billow/format/brick.h"
#include "interface.h"
#include "stream/distance_field.h"

namespace billow::runtime {
namespace {

using format::Node3;
using format::Rule;
using format::Stream;

// Writes, for each mask word, how many bits come before it: two counts a word, the first in the low half.
void writeRanks(std::span<const std::uint32_t> mask, std::span<std::uint32_t> ranks) {
  std::uint32_t count = 0;
  for (std::size_t word = 0; word < mask.size(); word += 2) {
    const auto second = count + static_cast<std::uint32_t>(std::popcount(mask[word]));
    ranks[word / 2] = count | second << 16;
    count = second + static_cast<std::uint32_t>(std::popcount(mask[word + 1]));
  }
}

}  // namespace

GridBuilder::GridBuilder(TreeWalk& walk, const GridPlan& grid, BrickPlaces& bricks, MaskTable& masks,
                         const GridScratch& scratch, std::span<std::byte> buffer)
    : walk_(walk),
      grid_(grid),
      bricks_(bricks),
      masks_(masks),
      scratch_(scratch),
      table_(itemsOf<std::uint32_t>(buffer, grid.table)),
      node4_(itemsOf<std::uint32_t>(buffer, grid.node4)),
      children_(itemsOf<std::uint32_t>(buffer, grid.children)),
      records_(itemsOf<GpuRecord>(buffer, grid.records), grid.frame->tileCount, grid.frame->background,
               scratch.tiles.first(grid.tileSlots)) {
  std::fill(scratch.records.begin(), scratch.records.end(), 0u);
  std::fill(scratch.lists.begin(), scratch.lists.end(), 0u);
}

bool GridBuilder::build() {
  const Root root = walk_.root();
  if (root.node == nullptr) return false;
  if (root.tile && !tile(root.node->tile, root.at, absent5_)) return false;
  if (!walkRoot(root)) return false;
  if (records_.used() != records_.room()) {
    return walk_.fail(Rule::counts, root.at,
                      "It reaches " + std::to_string(records_.used()) + " Node3s and values of tiles, not " +
                          std::to_string(records_.room()) + ".");
  }
  return true;
}

bool GridBuilder::walkRoot(const Root& root) {
  if (!beginIndex(root)) return false;
  std::uint32_t place = 0;
  const bool done = forEachBit(root.node->mask, [&](std::uint32_t bit) {
    const Upper node = walk_.node4(root.at, root.children.list[place]);
    return node.node != nullptr && addNode4(bit, place++, node);
  });
  if (!done) return false;
  std::fill(children_.begin() + childrenUsed_, children_.end(), 0u);
  if (grid_.index == Index::flat && grid_.frame->background == 0) {
    DistanceField(grid_.cells, scratch_.distances).addTo(table_);
  }
  return true;
}

// All but Node4s.
bool GridBuilder::beginIndex(const Root& root) {
  if (grid_.index == Index::flat) {
    std::fill(table_.begin(), table_.end(), absent5_);
    return true;
  }
  const std::uint64_t words = grid_.index == Index::tree ? gpu::kTreeNode4Words : 4096;
  if (root.children.count * words > node4_.size()) {
    return walk_.fail(Rule::counts, root.at, "It has more children than the grid frame says.");
  }
  const auto rest = node4_.subspan(root.children.count * words);
  std::fill(rest.begin(), rest.end(), 0u);
  if (grid_.index == Index::tree) {
    std::copy(std::begin(root.node->mask), std::end(root.node->mask), table_.begin());
    writeRanks(root.node->mask, table_.subspan(1024));
  } else {
    std::fill(table_.begin(), table_.end(), 0u);
  }
  return true;
}

bool GridBuilder::addNode4(std::uint32_t bit, std::uint32_t place, const Upper& node) {
  std::uint32_t absent = 0;
  if (node.tile && !tile(node.node->tile, node.at, absent)) return false;
  if (grid_.index == Index::flat) return addToCells(bit, absent, node);
  if (grid_.index == Index::tree) return addToTree(place, absent, node);
  table_[bit] = place + 1;
  return addToDense(place, absent, node);
}

// Cells of the box that a child of the root covers get the record.
void GridBuilder::fillCells(std::uint32_t bit, std::uint32_t record) {
  const std::uint32_t first[3] = {bit >> 10 << 4, (bit >> 5 & 31) << 4, (bit & 31) << 4};
  std::uint32_t low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t min = grid_.cells.min[axis], end = min + grid_.cells.dim[axis];
    low[axis] = std::clamp(first[axis], min, end) - min;
    high[axis] = std::clamp(first[axis] + 16, min, end) - min;
  }
  for (std::uint32_t x = low[0]; x < high[0]; ++x) {
    for (std::uint32_t y = low[1]; y < high[1]; ++y) {
      std::uint32_t* const row = &table_[(std::size_t{x} * grid_.cells.dim[1] + y) * grid_.cells.dim[2]];
      std::fill(row + low[2], row + high[2], record);
    }
  }
}

bool GridBuilder::addToCells(std::uint32_t bit, std::uint32_t absent, const Upper& node) {
  if (absent != 0) fillCells(bit, absent);
  const format::CellBox& cells = grid_.cells;
  const std::uint32_t first[3] = {(bit >> 10 << 4) - cells.min[0], ((bit >> 5 & 31) << 4) - cells.min[1],
                                  ((bit & 31) << 4) - cells.min[2]};
  const std::uint32_t* next = node.children.list;
  return forEachBit(node.node->mask, [&](std::uint32_t child) {
    const std::uint32_t number = record(*next++, node.at);
    // Wraps where the cell lies before the box.
    const std::uint32_t x = first[0] + (child >> 8), y = first[1] + (child >> 4 & 15), z = first[2] + (child & 15);
    if (x < cells.dim[0] && y < cells.dim[1] && z < cells.dim[2]) {
      table_[(std::size_t{x} * cells.dim[1] + y) * cells.dim[2] + z] = number;
    }
    return number != 0;
  });
}

bool GridBuilder::addToTree(std::uint32_t place, std::uint32_t absent, const Upper& node) {
  std::uint32_t& list = scratch_.lists[node.local];
  if (list == 0) {
    if (node.children.count > children_.size() - childrenUsed_) {
      return walk_.fail(Rule::counts, node.at, "With it there are more child list entries than the grid frame says.");
    }
    list = childrenUsed_ + 1;
    for (std::uint32_t i = 0; i < node.children.count; ++i) {
      const std::uint32_t number = record(node.children.list[i], node.at);
      if (number == 0) return false;
      children_[childrenUsed_++] = number;
    }
  }
  const std::span<std::uint32_t> words =
      node4_.subspan(std::size_t{place} * gpu::kTreeNode4Words, gpu::kTreeNode4Words);
  words[0] = list - 1;
  words[1] = absent;
  std::copy(std::begin(node.node->mask), std::end(node.node->mask), words.begin() + 2);
  writeRanks(node.node->mask, words.subspan(130));
  return true;
}

bool GridBuilder::addToDense(std::uint32_t place, std::uint32_t absent, const Upper& node) {
  const std::span<std::uint32_t> cells = node4_.subspan(std::size_t{place} * 4096, 4096);
  std::fill(cells.begin(), cells.end(), absent);
  const std::uint32_t* next = node.children.list;
  return forEachBit(node.node->mask, [&](std::uint32_t child) {
    cells[child] = record(*next++, node.at);
    return cells[child] != 0;
  });
}

bool GridBuilder::checkValues(const Node3& node, const TreeWalk::Node& at) {
  const float high = format::reconstruct(node.lo, node.scale, format::largestTexel(format::encodingOf(node)));
  const auto values = [&] { return "lo " + std::to_string(node.lo) + ", scale " + std::to_string(node.scale) + "."; };
  if (!std::isfinite(node.lo) || !std::isfinite(node.scale) || !std::isfinite(high)) {
    return walk_.fail(Rule::brickFinite, at, values());
  }
  const bool constant = format::encodingOf(node) == format::kEncodingConstant;
  return node.scale < 0 || (constant && node.scale != 0) ? walk_.fail(Rule::brickScale, at, values()) : true;
}

std::uint32_t GridBuilder::addRecord(std::uint32_t index, const PageItems::Found& found) {
  const Node3& node = *reinterpret_cast<const Node3*>(found.data);
  const TreeWalk::Node at{"Node3", index, found.page};
  if (format::encodingOf(node) >= format::kEncodingCount) {
    walk_.fail(Rule::brickEncoding, at, "Encoding " + std::to_string(format::encodingOf(node)) + ".");
    return 0;
  }
  GpuRecord made{.brick = 0, .mask = node.mask, .lo = node.lo, .scale = node.scale};
  if (!checkValues(node, at) || !brickWord(node, at, made.brick) || !maskWord(node, at, made.mask)) return 0;
  const std::uint32_t number = records_.add(made);
  if (number == 0) walk_.fail(Rule::counts, at, "With it there are more Node3s than the grid frame says.");
  return scratch_.records[found.local] = number;
}

bool GridBuilder::brickWord(const Node3& node, const TreeWalk::Node& at, std::uint32_t& word) {
  const std::uint32_t encoding = format::encodingOf(node);
  if (encoding == format::kEncodingConstant) {
    word = 0;
    return format::unitOf(node) == 0 || walk_.fail(Rule::brickUnits, at, "It is constant, and has a unit.");
  }
  const PageItems::Found found =
      walk_.find(Stream::unit, at, "unit", format::unitOf(node), format::brickUnits(encoding));
  if (found.data == nullptr) return false;
  const auto placed = bricks_.place(encoding, found.data, found.local);
  if (!placed) {
    return walk_.fail(Rule::counts, at, "Its units are in part another brick's, or more than the grid frame says.");
  }
  word = *placed;
  return true;
}

bool GridBuilder::maskWord(const Node3& node, const TreeWalk::Node& at, std::uint32_t& word) {
  if (node.mask == format::kMaskAll) return true;
  if (node.mask == format::kMaskTexel) {
    if (format::indexBits(format::encodingOf(node)) != 0) return true;
    return walk_.fail(Rule::brickMask, at, "Its encoding has no indices that could tell what is active.");
  }
  const PageItems::Found found = walk_.find(Stream::mask, at, "mask", node.mask, 1);
  if (found.data == nullptr) return false;
  std::uint32_t& number = masks_.numbers[found.local];
  if (number == 0) {
    if (masks_.used == masks_.masks.size()) {
      return walk_.fail(Rule::counts, at, "With it there are more masks than the grid frame says.");
    }
    std::memcpy(&masks_.masks[masks_.used], found.data, sizeof(format::Mask3));
    number = ++masks_.used;
  }
  word = number - 1;
  return true;
}

bool GridBuilder::tile(float value, const TreeWalk::Node& at, std::uint32_t& number) {
  const auto found = records_.tile(value);
  if (!found) return walk_.fail(Rule::counts, at, "With it there are more values of tiles than the grid frame says.");
  number = *found;
  return true;
}

}  // namespace billow::runtime
