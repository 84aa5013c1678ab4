#include "metric/cell_lookup.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace billow::compiler {
namespace {

Origin roundDown(const Origin& at, std::int32_t step) {
  Origin result{};
  for (std::size_t a = 0; a < 3; ++a) result[a] = at[a] - ((at[a] % step) + step) % step;
  return result;
}

// The aligned cubes of `step` voxels that a tile touches.
template <class Visit>
void forEachCell(const Tile& tile, std::int32_t step, const Visit& visit) {
  const Origin first = roundDown(tile.origin, step);
  Origin last{};  // inclusive, so that no cell begins beyond what 32 bits hold
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t end = std::int64_t{tile.origin[a]} + tile.dim - 1;
    last[a] = static_cast<std::int32_t>(std::min<std::int64_t>(end, std::numeric_limits<std::int32_t>::max()));
  }
  for (std::int64_t x = first[0]; x <= last[0]; x += step) {
    for (std::int64_t y = first[1]; y <= last[1]; y += step) {
      for (std::int64_t z = first[2]; z <= last[2]; z += step) {
        visit({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), static_cast<std::int32_t>(z)});
      }
    }
  }
}

bool covers(const Tile& tile, const Origin& origin, std::uint32_t dim) {
  for (std::size_t a = 0; a < 3; ++a) {
    const std::int64_t low = tile.origin[a], at = origin[a];
    if (at < low || at + dim > low + tile.dim) return false;
  }
  return true;
}

}  // namespace

CellLookup::CellLookup(const ImportedGrid& grid) {
  for (const Leaf& leaf : grid.leaves) {
    leaves_.emplace(leaf.origin, &leaf);
    for (const std::uint32_t word : leaf.active.words) active_ += static_cast<std::uint64_t>(std::popcount(word));
  }
  for (const Tile& tile : grid.tiles) {
    active_ += std::uint64_t{tile.dim} * tile.dim * tile.dim;
    if (tile.dim > 128) {
      large_.push_back(&tile);
    } else if (tile.dim == 8) {
      small_.emplace(tile.origin, &tile);
    } else {
      forEachCell(tile, 128, [&](const Origin& cell) { tiles_.emplace(cell, &tile); });
    }
  }
}

const Leaf* CellLookup::leafAt(const Origin& cell) const {
  const auto found = leaves_.find(cell);
  return found == leaves_.end() ? nullptr : found->second;
}

const Tile* CellLookup::tileOver(const Origin& origin, std::uint32_t dim) const {
  for (const Tile* tile : large_) {
    if (covers(*tile, origin, dim)) return tile;
  }
  if (const auto found = small_.find(origin); found != small_.end() && dim == 8) return found->second;
  const auto [begin, end] = tiles_.equal_range(roundDown(origin, 128));
  for (auto entry = begin; entry != end; ++entry) {
    if (covers(*entry->second, origin, dim)) return entry->second;
  }
  return nullptr;
}

}  // namespace billow::compiler
