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
using format::Node4;
using format::Node5;
using format::Rule;
using format::Stream;

// A node that is shared by many parents becomes a leaf for each: a few bytes could ask for 2^27 of them.
constexpr std::uint64_t kMostLeaves = std::uint64_t{1} << 24;

template <class T>
const T& as(const std::byte* data) {
  return *reinterpret_cast<const T*>(data);
}

template <class F>
bool forEachBit(std::span<const std::uint32_t> words, const F& visit) {
  for (std::uint32_t w = 0; w < words.size(); ++w) {
    for (std::uint32_t rest = words[w]; rest != 0; rest &= rest - 1) {
      if (!visit(w * 32 + static_cast<std::uint32_t>(std::countr_zero(rest)))) return false;
    }
  }
  return true;
}

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

GridBuilder::GridBuilder(const LoadRequest& request, const GridPlan& grid, PageItems& items, BrickPlaces& bricks,
                         MaskTable& masks, const GridScratch& scratch, std::span<std::byte> buffer)
    : request_(request),
      grid_(grid),
      items_(items),
      bricks_(bricks),
      masks_(masks),
      scratch_(scratch),
      buffer_(buffer),
      table_(section<std::uint32_t>(grid.table)),
      node4_(section<std::uint32_t>(grid.node4)),
      children_(section<std::uint32_t>(grid.children)),
      records_(section<GpuRecord>(grid.records)) {
  std::fill(scratch.records.begin(), scratch.records.end(), 0u);
  std::fill(scratch.lists.begin(), scratch.lists.end(), 0u);
  std::fill_n(scratch.tiles.begin(), grid.tileSlots, 0u);
}

bool GridBuilder::fail(Rule rule, const Parent& at, std::string detail) {
  format::Place place = gridPlace(request_, grid_.number);
  const format::Place page = format::placeOfPage(*request_.pack, at.page);
  place.section = page.section;
  place.offset = page.offset;
  place.page = page.page;
  place.nodeKind = at.kind;
  place.node = at.index;
  issue_ = format::makeIssue(rule, place, std::move(detail));
  return false;
}

bool GridBuilder::failMissing(Stream stream, const Parent& at, const char* kind, std::uint64_t index) {
  const format::StreamRange& last =
      request_.pack->pages().back().streams[static_cast<std::uint32_t>(stream)];  // there is a page: `at` lies in it
  const std::uint64_t total = std::uint64_t{last.first} + last.count;
  const std::string which = std::string(kind) + " " + std::to_string(index);
  if (index < total) return fail(Rule::pageMissing, at, which + " lies in none of the pages that the frame lists.");
  const bool isNode = stream == Stream::node4 || stream == Stream::node3;
  const Rule rule = isNode                    ? Rule::childIndex
                    : stream == Stream::child ? Rule::nodeChildren
                    : stream == Stream::mask  ? Rule::brickMask
                                              : Rule::brickUnits;
  return fail(rule, at, which + " of " + std::to_string(total) + ".");
}

bool GridBuilder::build() {
  const PageItems::Found found = items_.find(Stream::node5, grid_.frame->node5, 1);
  if (found.data == nullptr) {
    format::Place place = gridPlace(request_, grid_.number);
    place.nodeKind = "Node5";
    place.node = grid_.frame->node5;
    issue_ = format::makeIssue(Rule::pageMissing, place, "It lies in none of the pages that the frame lists.");
    return false;
  }
  const Parent at{"Node5", grid_.frame->node5, found.page};
  const Node5& root = as<Node5>(found.data);
  Children children;
  if (!checkNode(root, at, children)) return false;
  if ((root.flags & format::kNodeTileActive) != 0 && !tile(root.tile, at, absent5_)) return false;
  if (!walk(root, at, children)) return false;
  if (recordsUsed_ != records_.size()) {
    return fail(Rule::counts, at,
                "It reaches " + std::to_string(recordsUsed_) + " Node3s and values of tiles, not " +
                    std::to_string(records_.size()) + ".");
  }
  return true;
}

template <class Node>
bool GridBuilder::checkNode(const Node& node, const Parent& at, Children& children) {
  for (const std::uint32_t word : node.mask) children.count += static_cast<std::uint32_t>(std::popcount(word));
  if ((node.flags & ~format::kNodeTileActive) != 0) {
    return fail(Rule::nodeFlags, at, "Its flags are " + std::to_string(node.flags) + ".");
  }
  if ((node.flags & format::kNodeTileActive) != 0) {
    if (children.count > 0) {
      return fail(Rule::nodeTileActive, at, "It has " + std::to_string(children.count) + " children.");
    }
    if (!std::isfinite(node.tile)) return fail(Rule::nodeFinite, at, "Its tile is " + std::to_string(node.tile) + ".");
  }
  if (children.count == 0) return true;
  const PageItems::Found found = items_.find(Stream::child, node.childBegin, children.count);
  if (found.data == nullptr) return failMissing(Stream::child, at, "child list entry", node.childBegin);
  children.list = reinterpret_cast<const std::uint32_t*>(found.data);
  return true;
}

bool GridBuilder::walk(const Node5& root, const Parent& at, const Children& children) {
  if (grid_.index == Index::flat) {
    std::fill(table_.begin(), table_.end(), absent5_);
  } else if (grid_.index == Index::tree) {
    beginTree(root);
  } else {
    std::fill(table_.begin(), table_.end(), 0u);
  }
  if (grid_.index != Index::flat) {
    const std::uint64_t words = grid_.index == Index::tree ? gpu::kTreeNode4Words : 4096;
    if (children.count * words > node4_.size()) return fail(Rule::counts, at, "It has more children than it says.");
    const auto rest = node4_.subspan(children.count * words);
    std::fill(rest.begin(), rest.end(), 0u);
  }
  std::uint32_t place = 0;
  const bool done = forEachBit(root.mask, [&](std::uint32_t bit) {
    if (grid_.index == Index::dense) table_[bit] = place + 1;
    const std::uint32_t index = children.list[place];
    return addNode4(bit, place++, at, index);
  });
  if (!done) return false;
  std::fill(children_.begin() + childrenUsed_, children_.end(), 0u);
  if (grid_.index == Index::flat && grid_.frame->background == 0) {
    DistanceField(grid_.cells, scratch_.distances).addTo(table_);
  }
  return true;
}

void GridBuilder::beginTree(const Node5& root) {
  std::copy(std::begin(root.mask), std::end(root.mask), table_.begin());
  writeRanks(root.mask, table_.subspan(1024));
}

bool GridBuilder::addNode4(std::uint32_t bit, std::uint32_t place, const Parent& parent, std::uint32_t index) {
  const PageItems::Found found = items_.find(Stream::node4, index, 1);
  if (found.data == nullptr) return failMissing(Stream::node4, parent, "Node4", index);
  const Node4& node = as<Node4>(found.data);
  const Parent at{"Node4", index, found.page};
  Children children;
  if (!checkNode(node, at, children)) return false;
  leaves_ += children.count;
  if (leaves_ > kMostLeaves) {
    return fail(Rule::tooManyBricks, at, "With it there are " + std::to_string(leaves_) + " of at most 16777216.");
  }
  std::uint32_t absent = 0;
  if ((node.flags & format::kNodeTileActive) != 0 && !tile(node.tile, at, absent)) return false;
  if (grid_.index == Index::flat) return addToCells(node, bit, absent, at, children);
  if (grid_.index == Index::tree) return addToTree(node, place, absent, found.local, at, children);
  return addToDense(node, place, absent, at, children);
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

bool GridBuilder::addToCells(const Node4& node, std::uint32_t bit, std::uint32_t absent, const Parent& at,
                             const Children& children) {
  if (absent != 0) fillCells(bit, absent);
  const format::CellBox& cells = grid_.cells;
  const std::uint32_t first[3] = {(bit >> 10 << 4) - cells.min[0], ((bit >> 5 & 31) << 4) - cells.min[1],
                                  ((bit & 31) << 4) - cells.min[2]};
  const std::uint32_t* next = children.list;
  return forEachBit(node.mask, [&](std::uint32_t child) {
    const std::uint32_t number = record(*next++, at);
    if (number == 0) return false;
    // Wraps where the cell lies before the box.
    const std::uint32_t x = first[0] + (child >> 8), y = first[1] + (child >> 4 & 15), z = first[2] + (child & 15);
    if (x < cells.dim[0] && y < cells.dim[1] && z < cells.dim[2]) {
      table_[(std::size_t{x} * cells.dim[1] + y) * cells.dim[2] + z] = number;
    }
    return true;
  });
}

bool GridBuilder::addToTree(const Node4& node, std::uint32_t place, std::uint32_t absent, std::uint32_t local,
                            const Parent& at, const Children& children) {
  std::uint32_t& list = scratch_.lists[local];
  if (list == 0) {
    if (children.count > children_.size() - childrenUsed_) {
      return fail(Rule::counts, at, "With it there are more child list entries than the grid frame says.");
    }
    list = childrenUsed_ + 1;
    for (std::uint32_t i = 0; i < children.count; ++i) {
      const std::uint32_t number = record(children.list[i], at);
      if (number == 0) return false;
      children_[childrenUsed_++] = number;
    }
  }
  const std::span<std::uint32_t> words =
      node4_.subspan(std::size_t{place} * gpu::kTreeNode4Words, gpu::kTreeNode4Words);
  words[0] = list - 1;
  words[1] = absent;
  std::copy(std::begin(node.mask), std::end(node.mask), words.begin() + 2);
  writeRanks(node.mask, words.subspan(130));
  return true;
}

bool GridBuilder::addToDense(const Node4& node, std::uint32_t place, std::uint32_t absent, const Parent& at,
                             const Children& children) {
  const std::span<std::uint32_t> cells = node4_.subspan(std::size_t{place} * 4096, 4096);
  std::fill(cells.begin(), cells.end(), absent);
  const std::uint32_t* next = children.list;
  return forEachBit(node.mask, [&](std::uint32_t child) {
    cells[child] = record(*next++, at);
    return cells[child] != 0;
  });
}

bool GridBuilder::checkValues(const Node3& node, const Parent& at) {
  const float high = format::reconstruct(node.lo, node.scale, format::largestTexel(format::encodingOf(node)));
  const auto values = [&] { return "lo " + std::to_string(node.lo) + ", scale " + std::to_string(node.scale) + "."; };
  if (!std::isfinite(node.lo) || !std::isfinite(node.scale) || !std::isfinite(high)) {
    return fail(Rule::brickFinite, at, values());
  }
  const bool constant = format::encodingOf(node) == format::kEncodingConstant;
  return node.scale < 0 || (constant && node.scale != 0) ? fail(Rule::brickScale, at, values()) : true;
}

std::uint32_t GridBuilder::addRecord(std::uint32_t index, const PageItems::Found& found) {
  const Node3& node = as<Node3>(found.data);
  const Parent at{"Node3", index, found.page};
  if (format::encodingOf(node) >= format::kEncodingCount) {
    fail(Rule::brickEncoding, at, "Encoding " + std::to_string(format::encodingOf(node)) + ".");
    return 0;
  }
  GpuRecord made{.brick = 0, .mask = node.mask, .lo = node.lo, .scale = node.scale};
  if (!checkValues(node, at) || !brickWord(node, at, made.brick) || !maskWord(node, at, made.mask)) return 0;
  if (recordsUsed_ == records_.size()) {
    fail(Rule::counts, at, "With it there are more Node3s than the grid frame says.");
    return 0;
  }
  records_[recordsUsed_] = made;
  return scratch_.records[found.local] = ++recordsUsed_;
}

bool GridBuilder::brickWord(const Node3& node, const Parent& at, std::uint32_t& word) {
  const std::uint32_t encoding = format::encodingOf(node);
  if (encoding == format::kEncodingConstant) {
    word = 0;
    return format::unitOf(node) == 0 || fail(Rule::brickUnits, at, "It is constant, and has a unit.");
  }
  const PageItems::Found found = items_.find(Stream::unit, format::unitOf(node), format::brickUnits(encoding));
  if (found.data == nullptr) return failMissing(Stream::unit, at, "unit", format::unitOf(node));
  const auto placed = bricks_.place(encoding, found.data, found.local);
  if (!placed) {
    return fail(Rule::counts, at, "Its units are in part another brick's, or more than the grid frame says.");
  }
  word = *placed;
  return true;
}

bool GridBuilder::maskWord(const Node3& node, const Parent& at, std::uint32_t& word) {
  if (node.mask == format::kMaskAll) return true;
  if (node.mask == format::kMaskTexel) {
    if (format::indexBits(format::encodingOf(node)) != 0) return true;
    return fail(Rule::brickMask, at, "Its encoding has no indices that could tell what is active.");
  }
  const PageItems::Found found = items_.find(Stream::mask, node.mask, 1);
  if (found.data == nullptr) return failMissing(Stream::mask, at, "mask", node.mask);
  std::uint32_t& number = masks_.numbers[found.local];
  if (number == 0) {
    if (masks_.used == masks_.masks.size()) {
      return fail(Rule::counts, at, "With it there are more masks than the grid frame says.");
    }
    std::memcpy(&masks_.masks[masks_.used], found.data, sizeof(format::Mask3));
    number = ++masks_.used;
  }
  word = number - 1;
  return true;
}

bool GridBuilder::tile(float value, const Parent& at, std::uint32_t& number) {
  number = 0;
  const auto bits = std::bit_cast<std::uint32_t>(value);
  if (bits == std::bit_cast<std::uint32_t>(grid_.frame->background)) return true;
  const auto last = static_cast<std::uint32_t>(grid_.tileSlots - 1);
  for (std::uint32_t slot = bits * 0x9e3779b1u >> 7 & last;; slot = (slot + 1) & last) {
    std::uint32_t& known = scratch_.tiles[slot];
    if (known == 0) {
      if (tilesUsed_ == grid_.frame->tileCount || recordsUsed_ == records_.size()) {
        return fail(Rule::counts, at, "With it there are more values of tiles than the grid frame says.");
      }
      ++tilesUsed_;
      records_[recordsUsed_] = {.brick = 0, .mask = format::kMaskAll, .lo = value, .scale = 0};
      known = ++recordsUsed_;
    }
    if (std::bit_cast<std::uint32_t>(records_[known - 1].lo) == bits) {
      number = known;
      return true;
    }
  }
}

}  // namespace billow::runtime
