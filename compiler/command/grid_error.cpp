#include "grid_error.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "metric/cell_lookup.h"

namespace billow::command {
namespace {

using compiler::ImportedGrid;
using compiler::Leaf;
using compiler::Origin;
using compiler::Tile;

constexpr std::int32_t kCell = 8;

std::uint64_t volumeOf(std::uint32_t dim) {
  return std::uint64_t{dim} * dim * dim;
}

std::uint64_t countOf(const format::Mask3& mask) {
  std::uint64_t count = 0;
  for (const std::uint32_t word : mask.words) count += static_cast<std::uint64_t>(std::popcount(word));
  return count;
}

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

  compiler::CellLookup lookup_;
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
