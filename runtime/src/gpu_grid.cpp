#include "gpu_grid.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>

#include "gpu_index.h"

namespace billow::runtime {
namespace {

using format::GridView;

// Records and masks, each distinct one once.
class RecordTable {
 public:
  RecordTable(GpuGrid& grid, BrickSlots& slots) : grid_(grid), slots_(slots) {}

  std::uint32_t leaf(const GridView::Leaf& leaf) {
    const auto [entry, fresh] = leaves_.try_emplace(leaf.index, 0);
    if (!fresh) return entry->second;
    const std::uint32_t maskWord = leaf.mask != nullptr ? mask(leaf) : leaf.node.mask;
    return entry->second = add({slots_.place(leaf), maskWord, leaf.node.lo, leaf.node.scale});
  }

  // 0 where the value is the background's.
  std::uint32_t tile(float value) {
    const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
    if (bits == std::bit_cast<std::uint32_t>(grid_.frame.background)) return 0;
    const auto [entry, fresh] = tiles_.try_emplace(bits, 0);
    if (fresh) entry->second = add({0, format::kMaskAll, value, 0});
    return entry->second;
  }

 private:
  std::uint32_t add(const GpuRecord& record) {
    grid_.records.push_back(record);
    return static_cast<std::uint32_t>(grid_.records.size());
  }

  std::uint32_t mask(const GridView::Leaf& leaf) {
    const auto [entry, fresh] = masks_.try_emplace(leaf.node.mask, static_cast<std::uint32_t>(grid_.masks.size()));
    if (fresh) grid_.masks.push_back(*leaf.mask);
    return entry->second;
  }

  GpuGrid& grid_;
  BrickSlots& slots_;
  std::unordered_map<std::uint32_t, std::uint32_t> leaves_;
  std::unordered_map<std::uint32_t, std::uint32_t> masks_;
  std::map<std::uint32_t, std::uint32_t> tiles_;
};

std::uint32_t regionOf(const std::uint32_t (&origin)[3]) {
  return origin[0] >> 7 << 10 | origin[1] >> 7 << 5 | origin[2] >> 7;
}

std::uint32_t childOf(const std::uint32_t (&origin)[3]) {
  return (origin[0] >> 3 & 15) << 8 | (origin[1] >> 3 & 15) << 4 | (origin[2] >> 3 & 15);
}

// The value where a region of 128^3 voxels has no leaf; the background where leaves fill it.
float absentValue(const GridView& view, const Region& region) {
  std::uint32_t child = 0;
  for (const RegionLeaf& leaf : region.leaves) {
    if (leaf.child != child) break;
    ++child;
  }
  if (child == 4096) return view.frame().background;
  return view.voxel(std::int64_t{region.number >> 10} * 128 + (child >> 8) * 8,
                    std::int64_t{region.number >> 5 & 31} * 128 + (child >> 4 & 15) * 8,
                    std::int64_t{region.number & 31} * 128 + (child & 15) * 8);
}

// Every region of the active box, in order of number.
std::vector<Region> gatherRegions(const GridView& view, const format::CellBox& cells, RecordTable& records) {
  std::vector<std::pair<std::uint32_t, RegionLeaf>> leaves;
  leaves.reserve(view.leaves().size());
  for (const GridView::Leaf& leaf : view.leaves()) {
    leaves.push_back({regionOf(leaf.origin), {childOf(leaf.origin), records.leaf(leaf)}});
  }
  std::sort(leaves.begin(), leaves.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second.child < b.second.child;
  });
  std::vector<Region> regions;
  auto next = leaves.begin();
  const auto last = [&](int axis) { return (cells.min[axis] + cells.dim[axis] - 1) >> 4; };
  for (std::uint32_t x = cells.min[0] >> 4; x <= last(0); ++x) {
    for (std::uint32_t y = cells.min[1] >> 4; y <= last(1); ++y) {
      for (std::uint32_t z = cells.min[2] >> 4; z <= last(2); ++z) {
        Region region{.number = x << 10 | y << 5 | z, .leaves = {}, .absent = 0};
        for (; next != leaves.end() && next->first == region.number; ++next) region.leaves.push_back(next->second);
        region.absent = records.tile(absentValue(view, region));
        regions.push_back(std::move(region));
      }
    }
  }
  return regions;
}

}  // namespace

Index chooseIndex(const format::GridFrame& frame, Index wanted) {
  if (wanted != Index::automatic) return wanted;
  return format::gpuBytes(frame).index == format::GpuIndex::flat ? Index::flat : Index::tree;
}

std::uint32_t BrickSlots::place(const GridView::Leaf& leaf) {
  const std::uint32_t encoding = format::encodingOf(leaf.node);
  if (encoding == format::kEncodingConstant) return 0;
  const auto [entry, fresh] = placed_.try_emplace(leaf.node.brick, 0);
  if (!fresh) return entry->second;
  const bool bc7 = format::brickClass(encoding) == format::BrickClass::bc7;
  if (bc7 && bc7_) {
    const auto slot = static_cast<std::uint32_t>(inAtlas_.size());
    inAtlas_.push_back({leaf.brick, encoding, slot});
    return entry->second = encoding << format::kEncodingShift | slot;
  }
  const auto slot = static_cast<std::uint32_t>(bufferSlots_ & format::kBrickUnitMask);
  inBuffer_.push_back({leaf.brick, encoding, slot});
  const std::uint32_t stored = bc7 ? format::kEncodingUniform8 : encoding;
  bufferSlots_ += format::brickUnits(stored);
  return entry->second = stored << format::kEncodingShift | slot;
}

void writeBrick(const StoredBrick& brick, std::span<std::byte> buffer) {
  std::byte* const place = &buffer[std::size_t{brick.slot} * format::kBrickUnitBytes];
  if (format::brickClass(brick.encoding) != format::BrickClass::bc7) {
    std::memcpy(place, brick.bytes.data(), brick.bytes.size());
    return;
  }
  format::Texels texels;
  format::decodeTexels(brick.encoding, brick.bytes, texels);
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) place[i] = static_cast<std::byte>(texels[i]);
}

GpuGrid buildGpuGrid(const GridView& view, Index wanted, BrickSlots& slots) {
  GpuGrid grid;
  grid.frame = view.frame();
  grid.cells = format::cellBox(grid.frame);
  grid.skippable = grid.frame.background == 0;
  grid.index = chooseIndex(grid.frame, wanted);
  if (grid.frame.node5 == format::kNone || grid.cells.count() == 0) return grid;
  RecordTable records(grid, slots);
  const std::vector<Region> regions = gatherRegions(view, grid.cells, records);
  if (grid.index == Index::flat) {
    buildFlat(grid, regions);
  } else if (grid.index == Index::tree) {
    buildTree(grid, regions);
  } else {
    buildDense(grid, regions);
  }
  return grid;
}

}  // namespace billow::runtime
