// One grid in one frame, on the CPU: all of its pages in memory, every reference checked once, then walked freely.
#ifndef BILLOW_FORMAT_GRID_VIEW_H
#define BILLOW_FORMAT_GRID_VIEW_H

#include <cstdint>
#include <span>
#include <vector>

#include "billow/format/brick.h"
#include "billow/format/gpu_size.h"
#include "billow/format/pack.h"

namespace billow::format {

class GridView {
 public:
  // Loads the pages that `gridFrame` lists and checks every node and brick that is reachable. A frame whose shared
  // nodes stand for more than 2^24 bricks, or whose pages hold more than 4 GiB, is refused (too-many-bricks,
  // frame-limit). Listed page numbers must be those of the pack's own tables.
  static Result<GridView> load(const Pack& pack, const GridFrame& gridFrame);

  // Leaves and tiles point into the view's own pages: moving keeps them valid, a copy's would not be its own.
  GridView(const GridView&) = delete;
  GridView& operator=(const GridView&) = delete;
  GridView(GridView&&) = default;
  GridView& operator=(GridView&&) = default;
  ~GridView() = default;

  const GridFrame& frame() const { return frame_; }

  struct Leaf {
    std::uint32_t origin[3];  // pack index space, multiples of 8
    std::uint32_t index;      // global Node3 index
    Node3 node;
    const Mask3* mask;                 // null unless node.mask is an index
    std::span<const std::byte> brick;  // empty for a constant
  };
  struct Tile {  // an active region without bricks: a childless Node4 (128) or Node5 (4096)
    std::uint32_t origin[3];
    std::uint32_t dim;
    float value;
  };
  // In tree order (Node5 bit, then Node4 bit): the same order for every reader.
  std::span<const Leaf> leaves() const { return leaves_; }
  std::span<const Tile> tiles() const { return tiles_; }

  // What the GPU's nearest lookup returns at pack index (x, y, z); the background outside of [0, 4095]^3.
  float voxel(std::int64_t x, std::int64_t y, std::int64_t z) const;

  // Null where the grid frame has no Node5.
  const Node5* root() const { return root_; }

 private:
  friend struct GridLoader;
  GridView() = default;

  GridFrame frame_{};
  std::vector<Page> pages_;
  std::vector<Leaf> leaves_;
  std::vector<Tile> tiles_;
  const Node5* root_ = nullptr;
  CellBox cells_{};
  // One entry per brick cell of the active box: 0, leaf number + 1, or a tile's; empty (binary search) for huge boxes.
  std::vector<std::uint32_t> leafTable_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_GRID_VIEW_H
