#include "gpu_index.h"

#include <algorithm>
#include <bit>
#include <map>
#include <span>

#include "interface.h"

namespace billow::runtime {
namespace {

struct Cell {
  std::uint32_t at[3];
};

Cell cellOf(std::uint32_t region, std::uint32_t child) {
  return {{(region >> 10) << 4 | child >> 8, (region >> 5 & 31) << 4 | (child >> 4 & 15),
           (region & 31) << 4 | (child & 15)}};
}

// Number of the flat entry, or the table's size outside of the box.
std::size_t flatEntry(const GpuGrid& grid, const Cell& cell) {
  std::size_t entry = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t local = cell.at[axis] - grid.cells.min[axis];
    if (local >= grid.cells.dim[axis]) return grid.table.size();
    entry = entry * grid.cells.dim[axis] + local;
  }
  return entry;
}

// Distances over the cells of the box and one layer before it: in that layer upper taps already reach into the box.
class DistanceField {
 public:
  explicit DistanceField(const GpuGrid& grid)
      : grid_(grid), x_(grid.cells.dim[0] + 1), y_(grid.cells.dim[1] + 1), z_(grid.cells.dim[2] + 1) {
    cells_.assign(std::size_t{x_} * y_ * z_, kFar);
    markBusy();
    // Two sweeps of the 3x3x3 neighbourhood give exact distances in the maximum norm.
    sweep(1);
    sweep(-1);
  }

  // In cells, 0 where a sample must be taken, at most 255. Indices from 0 within the box.
  std::uint32_t at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return cells_[number(x + 1, y + 1, z + 1)];
  }

 private:
  static constexpr std::uint8_t kFar = 255;

  std::size_t number(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return (std::size_t{x} * y_ + y) * z_ + z;
  }

  void markBusy() {
    std::size_t entry = 0;
    for (std::uint32_t x = 1; x < x_; ++x) {
      for (std::uint32_t y = 1; y < y_; ++y) {
        for (std::uint32_t z = 1; z < z_; ++z) {
          if (grid_.table[entry++] == 0) continue;
          for (std::uint32_t i = 0; i < 8; ++i) cells_[number(x - (i >> 2), y - (i >> 1 & 1), z - (i & 1))] = 0;
        }
      }
    }
  }

  // One sweep in ascending (1) or descending (-1) order, over the 13 neighbours that were visited before.
  void sweep(int order) {
    const int sx = static_cast<int>(x_), sy = static_cast<int>(y_), sz = static_cast<int>(z_);
    const auto from = [order](int size) { return order > 0 ? 0 : size - 1; };
    for (int x = from(sx); x >= 0 && x < sx; x += order) {
      for (int y = from(sy); y >= 0 && y < sy; y += order) {
        for (int z = from(sz); z >= 0 && z < sz; z += order) relax(x, y, z, order);
      }
    }
  }

  void relax(int x, int y, int z, int order) {
    std::uint8_t& here = cells_[number(std::uint32_t(x), std::uint32_t(y), std::uint32_t(z))];
    if (here == 0) return;
    std::uint8_t nearest = kFar - 1;
    for (int i = 0; i < 13; ++i) {
      const int nx = x + (i / 9 - 1) * order, ny = y + (i / 3 % 3 - 1) * order, nz = z + (i % 3 - 1) * order;
      if (!inside(nx, x_) || !inside(ny, y_) || !inside(nz, z_)) continue;
      nearest = std::min(nearest, cells_[number(std::uint32_t(nx), std::uint32_t(ny), std::uint32_t(nz))]);
    }
    here = std::min<std::uint8_t>(here, std::uint8_t(std::min<int>(nearest, kFar - 1) + 1));
  }

  static bool inside(int at, std::uint32_t size) { return at >= 0 && std::uint32_t(at) < size; }

  const GpuGrid& grid_;
  std::uint32_t x_, y_, z_;
  std::vector<std::uint8_t> cells_;
};

void addDistances(GpuGrid& grid) {
  const DistanceField field(grid);
  std::size_t entry = 0;
  for (std::uint32_t x = 0; x < grid.cells.dim[0]; ++x) {
    for (std::uint32_t y = 0; y < grid.cells.dim[1]; ++y) {
      for (std::uint32_t z = 0; z < grid.cells.dim[2]; ++z, ++entry) {
        const std::uint32_t distance = field.at(x, y, z);
        if (distance != 0) grid.table[entry] = gpu::kSkip | distance;
      }
    }
  }
}

void setBit(std::span<std::uint32_t> words, std::uint32_t bit) {
  words[bit >> 5] |= 1u << (bit & 31);
}

// Writes, for each mask word, how many bits come before it: two counts a word, the first in the low half.
void writeRanks(std::span<const std::uint32_t> mask, std::span<std::uint32_t> ranks) {
  std::uint32_t count = 0;
  for (std::size_t word = 0; word < mask.size(); ++word) {
    ranks[word / 2] |= count << (word % 2 * 16);
    count += static_cast<std::uint32_t>(std::popcount(mask[word]));
  }
}

// What most regions without leaves hold: they need no Node4.
std::uint32_t commonAbsent(const GpuGrid& grid, const std::vector<Region>& regions) {
  std::map<std::uint32_t, std::size_t> counts;
  for (const Region& region : regions) {
    if (region.leaves.empty()) ++counts[region.absent];
  }
  std::uint32_t best = 0;
  for (const auto& [record, count] : counts) {
    if (count > counts[best]) best = record;
  }
  return grid.records.empty() ? 0 : best;
}

bool needsNode4(const GpuGrid& grid, const Region& region) {
  return !region.leaves.empty() || region.absent != grid.absent5;
}

}  // namespace

void buildFlat(GpuGrid& grid, const std::vector<Region>& regions) {
  grid.table.assign(grid.cells.count(), 0);
  for (const Region& region : regions) {
    for (std::uint32_t child = 0; region.absent != 0 && child < 4096; ++child) {
      const std::size_t entry = flatEntry(grid, cellOf(region.number, child));
      if (entry < grid.table.size()) grid.table[entry] = region.absent;
    }
    for (const RegionLeaf& leaf : region.leaves) {
      const std::size_t entry = flatEntry(grid, cellOf(region.number, leaf.child));
      if (entry < grid.table.size()) grid.table[entry] = leaf.record;
    }
  }
  if (grid.skippable) addDistances(grid);
}

void buildTree(GpuGrid& grid, const std::vector<Region>& regions) {
  grid.absent5 = commonAbsent(grid, regions);
  grid.table.assign(gpu::kTreeNode5Words, 0);
  const std::span<std::uint32_t> node5(grid.table);
  for (const Region& region : regions) {
    if (!needsNode4(grid, region)) continue;
    setBit(node5.first(1024), region.number);
    const std::size_t begin = grid.node4.size();
    grid.node4.resize(begin + gpu::kTreeNode4Words, 0);
    const std::span<std::uint32_t> node = std::span(grid.node4).subspan(begin);
    node[0] = static_cast<std::uint32_t>(grid.children.size());
    node[1] = region.absent;
    for (const RegionLeaf& leaf : region.leaves) {
      setBit(node.subspan(2, 128), leaf.child);
      grid.children.push_back(leaf.record);
    }
    writeRanks(node.subspan(2, 128), node.subspan(130, 64));
  }
  writeRanks(node5.first(1024), node5.subspan(1024));
}

void buildDense(GpuGrid& grid, const std::vector<Region>& regions) {
  grid.absent5 = commonAbsent(grid, regions);
  grid.table.assign(32768, 0);
  for (const Region& region : regions) {
    if (!needsNode4(grid, region)) continue;
    const std::size_t begin = grid.node4.size();
    grid.node4.resize(begin + 4096, region.absent);
    for (const RegionLeaf& leaf : region.leaves) grid.node4[begin + leaf.child] = leaf.record;
    grid.table[region.number] = static_cast<std::uint32_t>(begin / 4096 + 1);
  }
}

}  // namespace billow::runtime
