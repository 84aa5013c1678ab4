#include "grid_error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace billow::command {
namespace {

using compiler::ImportedGrid;
using compiler::Leaf;
using compiler::Tile;
using Origin = std::array<std::int32_t, 3>;

constexpr std::int32_t kCell = 8;

struct OriginHash {
  std::size_t operator()(const Origin& at) const {
    std::uint64_t hash = 0;
    for (const std::int32_t x : at) hash = (hash ^ static_cast<std::uint32_t>(x)) * 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>(hash ^ hash >> 32);
  }
};

std::uint64_t volumeOf(std::uint32_t dim) {
  return std::uint64_t{dim} * dim * dim;
}

std::uint64_t countOf(const format::Mask3& mask) {
  std::uint64_t count = 0;
  for (const std::uint32_t word : mask.words) count += static_cast<std::uint64_t>(std::popcount(word));
  return count;
}

// Finds the leaf or tile that covers a cell of 8^3 voxels.
class Lookup {
 public:
  explicit Lookup(const ImportedGrid& grid) {
    for (const Leaf& leaf : grid.leaves) {
      leaves_.emplace(leaf.origin, &leaf);
      active_ += countOf(leaf.active);
    }
    for (const Tile& tile : grid.tiles) {
      active_ += volumeOf(tile.dim);
      if (tile.dim > 128) {
        large_.push_back(&tile);
      } else {
        forEachCell(tile, 128, [&](const Origin& cell) { tiles_.emplace(cell, &tile); });
      }
    }
  }

  std::uint64_t activeVoxels() const { return active_; }

  const Leaf* leafAt(const Origin& cell) const {
    const auto found = leaves_.find(cell);
    return found == leaves_.end() ? nullptr : found->second;
  }

  // The tile that covers the cube of `dim` voxels at `origin` whole.
  const Tile* tileOver(const Origin& origin, std::uint32_t dim) const {
    for (const Tile* tile : large_) {
      if (covers(*tile, origin, dim)) return tile;
    }
    const auto [begin, end] = tiles_.equal_range(roundDown(origin, 128));
    for (auto entry = begin; entry != end; ++entry) {
      if (covers(*entry->second, origin, dim)) return entry->second;
    }
    return nullptr;
  }

 private:
  static Origin roundDown(const Origin& at, std::int32_t step) {
    Origin result{};
    for (std::size_t a = 0; a < 3; ++a) result[a] = at[a] - ((at[a] % step) + step) % step;
    return result;
  }

  // The aligned cubes of `step` voxels that a tile touches.
  template <class Visit>
  static void forEachCell(const Tile& tile, std::int32_t step, const Visit& visit) {
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

  static bool covers(const Tile& tile, const Origin& origin, std::uint32_t dim) {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t low = tile.origin[a], at = origin[a];
      if (at < low || at + dim > low + tile.dim) return false;
    }
    return true;
  }

  std::unordered_map<Origin, const Leaf*, OriginHash> leaves_;
  std::unordered_multimap<Origin, const Tile*, OriginHash> tiles_;  // by the aligned 128^3 cubes they touch
  std::vector<const Tile*> large_;
  std::uint64_t active_ = 0;
};

class Measure {
 public:
  explicit Measure(const ImportedGrid& pack) : lookup_(pack) {}

  GridError run(const ImportedGrid& source) {
    for (const Leaf& leaf : source.leaves) {
      error_.sourceVoxels += countOf(leaf.active);
      addCell(leaf.origin, &leaf, 0);
    }
    for (const Tile& tile : source.tiles) {
      error_.sourceVoxels += volumeOf(tile.dim);
      addTile(tile);
    }
    error_.mismatchedVoxels = (error_.sourceVoxels - matched_) + (lookup_.activeVoxels() - matched_);
    return error_;
  }

 private:
  void addTile(const Tile& tile) {
    if (const Tile* other = lookup_.tileOver(tile.origin, tile.dim)) {
      return add(tile.value, other->value, volumeOf(tile.dim));
    }
    // A root tile that the pack does not hold whole is a mismatch already; its 134 million cells need no visit.
    if (tile.dim > 128) return;
    const auto dim = static_cast<std::int32_t>(tile.dim);
    for (std::int32_t x = 0; x < dim; x += kCell) {
      for (std::int32_t y = 0; y < dim; y += kCell) {
        for (std::int32_t z = 0; z < dim; z += kCell) {
          addCell({tile.origin[0] + x, tile.origin[1] + y, tile.origin[2] + z}, nullptr, tile.value);
        }
      }
    }
  }

  // One cell of the source: a leaf, or 512 active voxels of `value`.
  void addCell(const Origin& cell, const Leaf* leaf, float value) {
    const Leaf* other = lookup_.leafAt(cell);
    const Tile* tile = other == nullptr ? lookup_.tileOver(cell, kCell) : nullptr;
    if (other == nullptr && tile == nullptr) return;
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      if (leaf != nullptr && !format::maskBit(leaf->active, i)) continue;
      if (other != nullptr && !format::maskBit(other->active, i)) continue;
      add(leaf != nullptr ? leaf->values[i] : value, other != nullptr ? other->values[i] : tile->value, 1);
    }
  }

  void add(float source, float pack, std::uint64_t voxels) {
    const double difference = std::fabs(static_cast<double>(source) - static_cast<double>(pack));
    matched_ += voxels;
    error_.squaredError += difference * difference * static_cast<double>(voxels);
    error_.maxError = std::max(error_.maxError, difference);
  }

  Lookup lookup_;
  GridError error_;
  std::uint64_t matched_ = 0;
};

}  // namespace

double GridError::rmse() const {
  return sourceVoxels == 0 ? 0 : std::sqrt(squaredError / static_cast<double>(sourceVoxels));
}

GridError measureError(const ImportedGrid& source, const ImportedGrid& pack) {
  return Measure(pack).run(source);
}

}  // namespace billow::command
