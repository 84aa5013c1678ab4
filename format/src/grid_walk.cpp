#include "grid_walk.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <utility>

#include "billow/format/children.h"

namespace billow::format {
namespace {

constexpr std::uint16_t kNode4Last = (1u << kNode4SpanLog2) - 1;
constexpr std::uint16_t kNode5Last = (1u << kNode5SpanLog2) - 1;

// What a unit is to the bricks: not used, inside of one, or the first of one. That is kFirstUnit and the encoding, or
// kFirstBc7 with a bit for each axis by which it is packed: BC7 bricks that differ in that alone may share their bytes,
// and count as two.
constexpr std::uint8_t kInsideBrick = 1;
constexpr std::uint8_t kFirstUnit = 0x40;
constexpr std::uint8_t kFirstBc7 = 0x80;

// What an item of another array is.
constexpr std::uint8_t kReached = 1;
constexpr std::uint8_t kBroken = 2;

constexpr std::uint32_t number(Stream stream) {
  return static_cast<std::uint32_t>(stream);
}

template <class T>
const T* as(const std::byte* data) {
  return reinterpret_cast<const T*>(data);
}

}  // namespace

void GridWalk::Box::add(const Box& box, const std::array<std::uint32_t, 3>& origin) {
  if (box.empty()) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::min(low[axis], static_cast<std::uint16_t>(origin[axis] + box.low[axis]));
    high[axis] = std::max(high[axis], static_cast<std::uint16_t>(origin[axis] + box.high[axis]));
  }
}

GridWalk::GridWalk(const Pack& pack, const StreamTotals& totals, const GridFrame& gridFrame, const Place& place,
                   std::span<const Page> pages, IssueSink& sink)
    : frame_(gridFrame), place_(place), totals_(totals), pages_(pages), sink_(sink), finder_(pack, pages) {
  for (std::uint32_t s = 0; s < kStreamCount; ++s) reached_[s].resize(finder_.localCount(static_cast<Stream>(s)));
  bricks_.resize(finder_.localCount(Stream::node3));
  subtrees_.resize(finder_.localCount(Stream::node4));
}

bool GridWalk::check() {
  const std::uint64_t before = sink_.errors();
  if (frame_.node5 != kNone) {
    const ItemFinder::Found found = finder_.find(Stream::node5, frame_.node5, 1);
    if (found.data == nullptr) {
      reportMissing("Node5", frame_.node5);
      return false;
    }
    reached_[number(Stream::node5)][found.local] = kReached;
    root_ = as<Node5>(found.data);
    visitNode5(*root_);
  }
  // Totals of a tree in which something is missing say nothing.
  if (sink_.errors() == before && !sink_.stopped()) checkTotals();
  if (sink_.errors() == before && !sink_.stopped()) checkPagesNeeded();
  return sink_.errors() == before;
}

Place GridWalk::itemPlace(std::string_view kind, std::uint64_t index) const {
  Place place = place_;
  place.nodeKind = kind;
  place.node = index;
  return place;
}

void GridWalk::reportMissing(std::string_view kind, std::uint64_t index) {
  sink_.report(Rule::pageMissing, itemPlace(kind, index), "It lies in none of the pages that the grid frame lists.");
}

ItemFinder::Found GridWalk::findChild(const Parent& parent, std::uint32_t bit, Stream stream, std::string_view kind,
                                      std::uint32_t index) {
  const ItemFinder::Found found = finder_.find(stream, index, 1);
  if (found.data != nullptr) return found;
  if (index < totals_.count[number(stream)]) {
    reportMissing(kind, index);
  } else {
    sink_.report(Rule::childIndex, itemPlace(parent.kind, parent.index),
                 fmt::format("Child {} is {} {} of {}.", bit, kind, index, totals_.count[number(stream)]));
  }
  return found;
}

template <class Node>
const std::uint32_t* GridWalk::childList(const Node& node, const Parent& parent, std::uint32_t& children) {
  children = 0;
  for (const std::uint32_t word : node.mask) children += static_cast<std::uint32_t>(std::popcount(word));
  childCount_ += children;
  // Readers of a flat table never look at a node's tile, so it may not differ from what they return.
  const bool inactive = children < std::size(node.mask) * 32 && (node.flags & kNodeTileActive) == 0;
  if (inactive && node.tile != frame_.background) {
    sink_.report(Rule::nodeTile, itemPlace(parent.kind, parent.index),
                 fmt::format("It is {}, the background {}.", node.tile, frame_.background));
  }
  if (children == 0) return nullptr;
  const ItemFinder::Found list = finder_.find(Stream::child, node.childBegin, children);
  if (list.data == nullptr) reportMissing("child", node.childBegin);
  return as<std::uint32_t>(list.data);
}

void GridWalk::visitNode5(const Node5& node) {
  std::uint32_t children = 0;
  const std::uint32_t* list = childList(node, {"Node5", frame_.node5}, children);
  if (children == 0 && (node.flags & kNodeTileActive) != 0) {
    active_ = std::uint64_t{1} << 3 * kNode5SpanLog2;
    box_ = {{0, 0, 0}, {kNode5Last, kNode5Last, kNode5Last}};
    countTile(node.tile);
  }
  if (list == nullptr) return;
  forEachBit(node.mask, [&](std::uint32_t bit) {
    if (!sink_.stopped()) visitChild4(node, bit, *list++);
  });
}

void GridWalk::visitChild4(const Node5& parent, std::uint32_t bit, std::uint32_t index) {
  const ItemFinder::Found found = findChild({"Node5", frame_.node5}, bit, Stream::node4, "Node4", index);
  if (found.data == nullptr) return;
  const Node4& child = *as<Node4>(found.data);
  SubtreeFacts& facts = subtrees_[found.local];
  std::uint8_t& reached = reached_[number(Stream::node4)][found.local];
  if (reached == 0) {
    reached = kReached;
    ++node4Count_;
    visitNode4(child, index, facts);
  }
  if (!(child.min >= parent.min && child.max <= parent.max)) {
    sink_.report(Rule::nodeConservative, itemPlace("Node5", frame_.node5),
                 fmt::format("Node4 {} has [{}, {}], its parent [{}, {}].", index, child.min, child.max, parent.min,
                             parent.max));
  }
  active_ += facts.active;
  leafCount_ += facts.leaves;
  box_.add(facts.box, childOrigin(bit, kNode5Log2, kNode4SpanLog2));
}

void GridWalk::visitNode4(const Node4& node, std::uint32_t index, SubtreeFacts& facts) {
  std::uint32_t children = 0;
  const std::uint32_t* list = childList(node, {"Node4", index}, children);
  if (children == 0 && (node.flags & kNodeTileActive) != 0) {
    facts.active = std::uint64_t{1} << 3 * kNode4SpanLog2;
    facts.box = {{0, 0, 0}, {kNode4Last, kNode4Last, kNode4Last}};
    countTile(node.tile);
  }
  if (list == nullptr) return;
  forEachBit(node.mask, [&](std::uint32_t bit) {
    if (!sink_.stopped()) visitChild3(node, index, bit, *list++, facts);
  });
}

void GridWalk::visitChild3(const Node4& parent, std::uint32_t parentIndex, std::uint32_t bit, std::uint32_t index,
                           SubtreeFacts& facts) {
  const ItemFinder::Found found = findChild({"Node4", parentIndex}, bit, Stream::node3, "Node3", index);
  if (found.data == nullptr) return;
  const Node3& child = *as<Node3>(found.data);
  BrickFacts& brick = bricks_[found.local];
  std::uint8_t& reached = reached_[number(Stream::node3)][found.local];
  if (reached == 0) {
    ++node3Count_;
    reached = visitNode3(child, index, brick) ? kReached : kBroken;
  }
  if (reached == kBroken) return;
  ++facts.leaves;
  facts.active += brick.active;
  if (brick.active > 0) {
    facts.box.add({{brick.low[0], brick.low[1], brick.low[2]}, {brick.high[0], brick.high[1], brick.high[2]}},
                  childOrigin(bit, kNode4Log2, kNode3SpanLog2));
  }
  const auto contained = [&] { return brick.min >= parent.min && brick.max <= parent.max; };
  if (contained()) return;
  if (!brick.exact) measureExactly(child, brick);
  if (contained()) return;
  sink_.report(
      Rule::nodeConservative, itemPlace("Node4", parentIndex),
      fmt::format("Node3 {} has [{}, {}], its parent [{}, {}].", index, brick.min, brick.max, parent.min, parent.max));
}

bool GridWalk::findParts(const Node3& node, const Mask3*& mask, std::span<const std::byte>& brick) {
  mask = nullptr;
  brick = {};
  const std::uint32_t units = brickUnits(encodingOf(node));
  if (units > 0) {
    const ItemFinder::Found found = finder_.find(Stream::unit, unitOf(node), units);
    if (found.data == nullptr) return false;
    brick = {found.data, std::size_t{units} * kBrickUnitBytes};
  }
  if (node.mask == kMaskAll || node.mask == kMaskTexel) return true;
  mask = as<Mask3>(finder_.find(Stream::mask, node.mask, 1).data);
  return mask != nullptr;
}

bool GridWalk::visitNode3(const Node3& node, std::uint32_t index, BrickFacts& facts) {
  const std::uint32_t units = brickUnits(encodingOf(node));
  if (units > 0) {
    const ItemFinder::Found found = finder_.find(Stream::unit, unitOf(node), units);
    if (found.data == nullptr) return reportMissing("brick", unitOf(node)), false;
    if (!countUnits(found.local, encodingOf(node), units)) {
      sink_.report(Rule::brickOverlap, itemPlace("Node3", index), "Its units are in part those of another brick.");
    }
  }
  if (node.mask == kMaskTexel) {
    measureExactly(node, facts);
  } else if (node.mask == kMaskAll) {
    facts.active = kBrickVoxels;
    facts.high.fill(7);
    facts.boundValues(node, frame_.background);
  } else {
    const ItemFinder::Found found = finder_.find(Stream::mask, node.mask, 1);
    if (found.data == nullptr) return reportMissing("mask", node.mask), false;
    maskCount_ += std::exchange(reached_[number(Stream::mask)][found.local], kReached) == 0 ? 1 : 0;
    facts.measureActive(*as<Mask3>(found.data));
    facts.boundValues(node, frame_.background);
  }
  checkMean(node, index);
  return true;
}

// Counts a brick when it is met first; false where it cuts another.
bool GridWalk::countUnits(std::uint32_t local, std::uint32_t encoding, std::uint32_t units) {
  const std::span<std::uint8_t> own = std::span(reached_[number(Stream::unit)]).subspan(local, units);
  const auto first = isBc7(encoding) ? static_cast<std::uint8_t>(kFirstBc7 | 1u << packedAxis(encoding))
                                     : static_cast<std::uint8_t>(kFirstUnit | encoding);
  if (isBc7(encoding) && (own[0] & kFirstBc7) != 0) {
    if ((own[0] & first) != first) countBrick(counted_, encoding);
    own[0] |= first;
    return true;
  }
  if (own[0] == first) return true;
  if (!std::all_of(own.begin(), own.end(), [](std::uint8_t unit) { return unit == 0; })) return false;
  std::fill(own.begin(), own.end(), kInsideBrick);
  own[0] = first;
  countBrick(counted_, encoding);
  return true;
}

void GridWalk::checkMean(const Node3& node, std::uint32_t index) {
  const float background = frame_.background;
  const float high = largestValue(node);
  if (node.mean >= std::min(node.lo, background) && node.mean <= std::max(high, background)) return;
  sink_.report(
      Rule::brickMean, itemPlace("Node3", index),
      fmt::format("It is {}, the brick holds [{}, {}], the background is {}.", node.mean, node.lo, high, background));
}

void GridWalk::countTile(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  if (bits != std::bit_cast<std::uint32_t>(frame_.background)) tiles_.insert(bits);
}

void GridWalk::measureExactly(const Node3& node, BrickFacts& facts) {
  const Mask3* mask = nullptr;
  std::span<const std::byte> brick;
  if (!findParts(node, mask, brick)) return;
  Values values;
  Mask3 active;
  decodeBrick(node, mask, brick, frame_.background, values, active);
  facts.measureValues(values);
  facts.measureActive(active);
}

void GridWalk::checkTotals() {
  const auto compare = [&](std::string_view what, std::uint64_t said, std::uint64_t is) {
    if (said != is) sink_.report(Rule::counts, place_, fmt::format("It says {} {}, and reaches {}.", said, what, is));
  };
  compare("Node4", frame_.node4Count, node4Count_);
  compare("Node3", frame_.node3Count, node3Count_);
  compare("masks", frame_.maskCount, maskCount_);
  compare("child list entries", frame_.childCount, childCount_);
  constexpr std::string_view kClassNames[kBrickClassCount] = {"BC7 bricks", "uniform bricks", "local bricks",
                                                              "coarse bricks"};
  constexpr std::string_view kUnitNames[kBrickClassCount] = {"BC7 units", "uniform units", "local units",
                                                             "coarse units"};
  for (std::uint32_t i = 0; i < kBrickClassCount; ++i) {
    compare(kClassNames[i], frame_.brickCount[i], counted_.brickCount[i]);
    compare(kUnitNames[i], frame_.brickUnits[i], counted_.brickUnits[i]);
  }
  compare("values of tiles", frame_.tileCount, tiles_.size());
  if (frame_.activeVoxels != active_) {
    sink_.report(Rule::activeVoxels, place_, fmt::format("It says {}, and reaches {}.", frame_.activeVoxels, active_));
  }
  checkBox();
  if (root_ != nullptr && !(frame_.valueMin <= root_->min && root_->max <= frame_.valueMax)) {
    sink_.report(
        Rule::valueRange, place_,
        fmt::format("It says [{}, {}], its Node5 [{}, {}].", frame_.valueMin, frame_.valueMax, root_->min, root_->max));
  }
}

void GridWalk::checkBox() {
  if (box_.empty()) return;
  bool holds = true, tight = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    holds &= frame_.activeMin[axis] <= box_.low[axis] && frame_.activeMax[axis] >= box_.high[axis];
    tight &= frame_.activeMin[axis] == box_.low[axis] && frame_.activeMax[axis] == box_.high[axis];
  }
  if (tight) return;
  sink_.report(holds ? Rule::activeBoxLoose : Rule::activeBox, place_,
               fmt::format("The active voxels fill [{}, {}] x [{}, {}] x [{}, {}].", box_.low[0], box_.high[0],
                           box_.low[1], box_.high[1], box_.low[2], box_.high[2]));
}

void GridWalk::checkPagesNeeded() {
  const std::span<const std::uint8_t> used = finder_.pagesUsed();
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] != 0) continue;
    Place place = place_;
    place.page = pages_[i].number;
    sink_.report(Rule::pageSuperfluous, place, "The grid frame reaches nothing in it.");
  }
}

}  // namespace billow::format
