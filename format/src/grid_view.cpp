#include "billow/format/grid_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "billow/format/children.h"
#include "grid_walk.h"
#include "guard.h"

namespace billow::format {
namespace {

// A node that is shared by many parents becomes a leaf for each: a few bytes could ask for 2^27 of them.
constexpr std::uint64_t kMostLeaves = std::uint64_t{1} << 24;
constexpr std::uint64_t kMostTableCells = std::uint64_t{1} << 24;
constexpr std::uint32_t kTileEntry = 0x80000000u;

// Where a region begins in tree order: bit of its Node4, then bit of its Node3.
std::uint32_t treeOrder(const std::uint32_t (&origin)[3]) {
  return childBit(origin, kNode5Log2, kNode4SpanLog2) << 3 * kNode4Log2 | childBit(origin, kNode4Log2, kNode3SpanLog2);
}

// childOrigin(), from a parent that begins at `parent`.
void placeChild(const std::uint32_t (&parent)[3], std::uint32_t bit, std::uint32_t log2, std::uint32_t childSpanLog2,
                std::uint32_t (&origin)[3]) {
  const std::array<std::uint32_t, 3> offset = childOrigin(bit, log2, childSpanLog2);
  for (std::size_t axis = 0; axis < 3; ++axis) origin[axis] = parent[axis] + offset[axis];
}

float valueIn(const GridView::Leaf& leaf, float background, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const Node3& node = leaf.node;
  if (leaf.mask != nullptr && !maskBit(*leaf.mask, voxelIndex(x, y, z))) return background;
  const std::uint32_t encoding = encodingOf(node);
  if (node.mask == kMaskTexel && decodeIndex(encoding, leaf.brick, voxelIndex(x, y, z)) == 0) return background;
  return reconstruct(node.lo, node.scale, decodeTexel(encoding, leaf.brick, x, y, z));
}

template <class Region>
const Region* findRegion(std::span<const Region> regions, std::uint32_t order) {
  const auto after = std::upper_bound(regions.begin(), regions.end(), order,
                                      [](std::uint32_t at, const Region& r) { return at < treeOrder(r.origin); });
  return after == regions.begin() ? nullptr : &*(after - 1);
}

}  // namespace

// Loads and lays out one grid frame.
struct GridLoader {
  const Pack& pack;
  GridView& view;
  FirstError& sink;
  StreamTotals totals{};

  bool run() {
    totals = streamTotals(pack.pages());
    if (!loadPages()) return false;
    const Place place = framePlace();
    GridWalk walk(pack, totals, view.frame_, place, view.pages_, sink);
    if (!walk.check()) return false;
    if (walk.leafCount() > kMostLeaves) {
      sink.report(Rule::tooManyBricks, place, fmt::format("It has {}, at most {}.", walk.leafCount(), kMostLeaves));
      return false;
    }
    view.root_ = walk.root();
    if (view.root_ != nullptr) layOut(walk);
    fillTable();
    return true;
  }

  // Only where the caller passed the pack's own record is its place known.
  Place framePlace() const {
    const GridFrame* first = pack.gridFrames().data();
    const GridFrame* given = original;
    const std::less<> before;
    if (before(given, first) || !before(given, first + pack.gridFrames().size())) return {};
    return PackReader::view(pack).gridFramePlace(static_cast<std::uint64_t>(given - first));
  }

  bool loadPages() {
    const std::uint32_t begin = view.frame_.pageListBegin, count = view.frame_.pageListCount;
    const std::size_t entries = pack.pageLists().size();
    if (begin > entries || count > entries - begin) {
      sink.report(Rule::pageListRange, framePlace(), fmt::format("{} entries at {} of {}.", count, begin, entries));
      return false;
    }
    const std::span<const std::uint32_t> list = pack.pageLists().subspan(begin, count);
    if (!checkListedBytes(pack.pages(), list, framePlace(), sink)) return false;
    for (const std::uint32_t number : list) {
      Page page;
      if (!loadPage(pack, number, page, sink) || !checkPageItems(pack, totals, page, sink)) return false;
      view.pages_.push_back(std::move(page));
    }
    return true;
  }

  void layOut(GridWalk& walk) {
    constexpr std::uint32_t kZero[3] = {0, 0, 0};
    view.leaves_.reserve(walk.leafCount());
    const Node5& root = *view.root_;
    if ((root.flags & kNodeTileActive) != 0) view.tiles_.push_back({{0, 0, 0}, kIndexSpan, root.tile});
    const std::uint32_t* next = children(walk, root.childBegin);
    forEachBit(root.mask, [&](std::uint32_t bit) {
      const auto& node = *item<Node4>(walk, Stream::node4, *next++);
      std::uint32_t origin[3];
      placeChild(kZero, bit, kNode5Log2, kNode4SpanLog2, origin);
      layOutNode4(walk, node, origin);
    });
  }

  void layOutNode4(GridWalk& walk, const Node4& node, const std::uint32_t (&origin)[3]) {
    if ((node.flags & kNodeTileActive) != 0) {
      view.tiles_.push_back({{origin[0], origin[1], origin[2]}, 1u << kNode4SpanLog2, node.tile});
    }
    const std::uint32_t* next = children(walk, node.childBegin);
    forEachBit(node.mask, [&](std::uint32_t bit) {
      GridView::Leaf leaf{};
      leaf.index = *next++;
      leaf.node = *item<Node3>(walk, Stream::node3, leaf.index);
      placeChild(origin, bit, kNode4Log2, kNode3SpanLog2, leaf.origin);
      walk.findParts(leaf.node, leaf.mask, leaf.brick);
      view.leaves_.push_back(leaf);
    });
  }

  // A checked list begins in the pages if it has entries; else the result isn't read.
  static const std::uint32_t* children(GridWalk& walk, std::uint32_t begin) {
    return item<std::uint32_t>(walk, Stream::child, begin);
  }

  template <class T>
  static const T* item(GridWalk& walk, Stream stream, std::uint32_t index) {
    return reinterpret_cast<const T*>(walk.finder().find(stream, index, 1).data);
  }

  void fillTable() {
    const CellBox box = cellBox(view.frame_);
    if (box.count() == 0 || box.count() > kMostTableCells) return;
    view.leafTable_.assign(box.count(), 0);
    for (std::size_t i = 0; i < view.tiles_.size(); ++i) {
      const GridView::Tile& tile = view.tiles_[i];
      fillCells(box, tile.origin, tile.dim >> kNode3SpanLog2, kTileEntry | static_cast<std::uint32_t>(i));
    }
    for (std::size_t i = 0; i < view.leaves_.size(); ++i) {
      fillCells(box, view.leaves_[i].origin, 1, static_cast<std::uint32_t>(i) + 1);
    }
  }

  void fillCells(const CellBox& box, const std::uint32_t (&origin)[3], std::uint32_t dim, std::uint32_t entry) {
    std::uint32_t low[3], high[3];
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t cell = origin[axis] >> kNode3SpanLog2;
      low[axis] = std::max(cell, box.min[axis]);
      high[axis] = std::min(cell + dim, box.min[axis] + box.dim[axis]);
    }
    for (std::uint32_t x = low[0]; x < high[0]; ++x) {
      for (std::uint32_t y = low[1]; y < high[1]; ++y) {
        const std::size_t row = (std::size_t{x - box.min[0]} * box.dim[1] + (y - box.min[1])) * box.dim[2] - box.min[2];
        for (std::uint32_t z = low[2]; z < high[2]; ++z) view.leafTable_[row + z] = entry;
      }
    }
  }

  const GridFrame* original = nullptr;
};

Result<GridView> GridView::load(const Pack& pack, const GridFrame& gridFrame) {
  return guarded<GridView>([&]() -> Result<GridView> {
    GridView view;
    view.frame_ = gridFrame;
    FirstError sink;
    GridLoader loader{.pack = pack, .view = view, .sink = sink, .original = &gridFrame};
    if (!loader.run()) return tl::make_unexpected(std::move(sink.issue()));
    view.cells_ = cellBox(gridFrame);
    return view;
  });
}

float GridView::voxel(std::int64_t x, std::int64_t y, std::int64_t z) const {
  // Outside of the active box everything is inactive, and what is inactive is the background.
  const std::int64_t at[3] = {x, y, z};
  for (int axis = 0; axis < 3; ++axis) {
    if (at[axis] < frame_.activeMin[axis] || at[axis] > frame_.activeMax[axis]) return frame_.background;
  }
  const std::uint32_t origin[3] = {static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                                   static_cast<std::uint32_t>(z)};
  const Leaf* leaf = nullptr;
  const Tile* tile = nullptr;
  if (!leafTable_.empty()) {
    const std::size_t row =
        std::size_t{(origin[0] >> 3) - cells_.min[0]} * cells_.dim[1] + (origin[1] >> 3) - cells_.min[1];
    const std::uint32_t entry = leafTable_[row * cells_.dim[2] + (origin[2] >> 3) - cells_.min[2]];
    if ((entry & kTileEntry) != 0) {
      tile = &tiles_[entry & ~kTileEntry];
    } else if (entry != 0) {
      leaf = &leaves_[entry - 1];
    }
  } else {
    const std::uint32_t order = treeOrder(origin);
    leaf = findRegion(leaves(), order);
    if (leaf != nullptr && treeOrder(leaf->origin) != order) leaf = nullptr;
    tile = findRegion(tiles(), order);
    if (tile != nullptr && tile->dim < kIndexSpan && treeOrder(tile->origin) >> 12 != order >> 12) tile = nullptr;
  }
  if (leaf != nullptr) return valueIn(*leaf, frame_.background, origin[0] & 7, origin[1] & 7, origin[2] & 7);
  return tile != nullptr ? tile->value : frame_.background;
}

}  // namespace billow::format
