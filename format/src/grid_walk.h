// One grid in one frame, walked from its Node5: what open readers and the validator check alike.
#ifndef BILLOW_FORMAT_SRC_GRID_WALK_H
#define BILLOW_FORMAT_SRC_GRID_WALK_H

#include <array>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "billow/format/gpu_size.h"
#include "brick_facts.h"
#include "item_finder.h"

namespace billow::format {

// Checks everything that the grid frame reaches. Memory safe whatever the pages hold.
class GridWalk {
 public:
  // `place` names the grid frame; `pages` are those that it lists, in that order.
  GridWalk(const Pack& pack, const StreamTotals& totals, const GridFrame& gridFrame, const Place& place,
           std::span<const Page> pages, IssueSink& sink);

  // False when an error was reported.
  bool check();

  // Mask and stored bytes of a reachable Node3; false where they aren't in the pages.
  bool findParts(const Node3& node, const Mask3*& mask, std::span<const std::byte>& brick);

  // After check() returned true:
  std::uint64_t leafCount() const { return leafCount_; }
  ItemFinder& finder() { return finder_; }
  const Node5* root() const { return root_; }
  // Which local items were reached: not zero.
  std::span<const std::uint8_t> reached(Stream stream) const { return reached_[static_cast<std::uint32_t>(stream)]; }

 private:
  struct Box {  // of active voxels, inclusive, relative to the node; empty when low > high
    std::array<std::uint16_t, 3> low{0xffff, 0xffff, 0xffff};
    std::array<std::uint16_t, 3> high{0, 0, 0};
    void add(const Box& box, const std::array<std::uint32_t, 3>& origin);
    bool empty() const { return low[0] > high[0]; }
  };
  struct SubtreeFacts {  // of a distinct Node4
    std::uint64_t active = 0;
    std::uint32_t leaves = 0;
    Box box;
  };

  struct Parent {  // the node whose children are looked at
    std::string_view kind;
    std::uint32_t index;
  };

  Place itemPlace(std::string_view kind, std::uint64_t index) const;
  void reportMissing(std::string_view kind, std::uint64_t index);
  // Null where the child doesn't exist, which is reported.
  ItemFinder::Found findChild(const Parent& parent, std::uint32_t bit, Stream stream, std::string_view kind,
                              std::uint32_t index);
  // The node's child list; null where it has none, or where it is missing, which is reported.
  template <class Node>
  const std::uint32_t* childList(const Node& node, const Parent& parent, std::uint32_t& children);
  void visitNode5(const Node5& node);
  void visitChild4(const Node5& parent, std::uint32_t bit, std::uint32_t index);
  void visitNode4(const Node4& node, std::uint32_t index, SubtreeFacts& facts);
  void visitChild3(const Node4& parent, std::uint32_t parentIndex, std::uint32_t bit, std::uint32_t index,
                   SubtreeFacts& facts);
  // False where a part of it is missing, which is reported.
  bool visitNode3(const Node3& node, std::uint32_t index, BrickFacts& facts);
  bool countUnits(std::uint32_t local, std::uint32_t encoding, std::uint32_t units);
  void countTile(float value);
  void checkMean(const Node3& node, std::uint32_t index);
  void measureExactly(const Node3& node, BrickFacts& facts);
  void checkTotals();
  void checkBox();
  void checkPagesNeeded();

  const GridFrame& frame_;
  const Place place_;
  const StreamTotals& totals_;
  std::span<const Page> pages_;
  IssueSink& sink_;
  ItemFinder finder_;
  const Node5* root_ = nullptr;
  std::array<std::vector<std::uint8_t>, kStreamCount> reached_;
  std::vector<BrickFacts> bricks_;  // of distinct Node3s
  std::vector<SubtreeFacts> subtrees_;
  std::uint64_t node4Count_ = 0, node3Count_ = 0, maskCount_ = 0, childCount_ = 0, leafCount_ = 0, active_ = 0;
  GridFrame counted_{};            // brickUnits and brickCount of what was reached
  std::set<std::uint32_t> tiles_;  // bits of active tiles' values other than the background
  Box box_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_GRID_WALK_H
