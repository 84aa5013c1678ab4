#include "level/coarsen.h"

#include <algorithm>
#include <bit>
#include <tuple>

#include "parallel.h"

namespace billow::compiler {
namespace {

using Origin = std::array<std::int32_t, 3>;

// Of 8, 128: where the block that a voxel or block lies in begins.
Origin blockOf(const Origin& fine, std::uint32_t log2, std::int32_t dim) {
  Origin coarse{};
  for (std::size_t a = 0; a < 3; ++a) coarse[a] = (fine[a] >> log2) & -dim;  // rounds down, below 0 too
  return coarse;
}

// A leaf, or a tile of 8^3 voxels, by the coarse leaf that it lies in.
struct Part {
  Origin block;
  bool tile;
  std::size_t index;
  bool operator<(const Part& other) const {
    return std::tie(block, tile, index) < std::tie(other.block, other.tile, other.index);
  }
};

class Coarsening {
 public:
  Coarsening(const ImportedGrid& grid, std::uint32_t log2) : grid_(grid), log2_(log2) {}

  ImportedGrid run() {
    coarse_.present = true;
    coarse_.background = coarse_.min = coarse_.max = grid_.background;
    coarse_.file = grid_.file;
    place();
    makeLeaves();
    makeTiles();
    std::ranges::sort(coarse_.tiles, [](const Tile& a, const Tile& b) {
      return std::tie(a.origin, a.dim) < std::tie(b.origin, b.dim);
    });
    measure();
    return std::move(coarse_);
  }

 private:
  void place() {
    const double factor = static_cast<double>(1u << log2_), middle = (factor - 1) / 2;
    for (std::size_t row = 0; row < 3; ++row) {
      const double* from = &grid_.indexToWorld[4 * row];
      double* to = &coarse_.indexToWorld[4 * row];
      for (std::size_t axis = 0; axis < 3; ++axis) to[axis] = factor * from[axis];
      to[3] = from[3] + (from[0] * middle + from[1] * middle + from[2] * middle);
    }
  }

  void makeLeaves() {
    std::vector<Part> parts;
    for (std::size_t i = 0; i < grid_.leaves.size(); ++i) {
      parts.push_back({blockOf(grid_.leaves[i].origin, log2_, 8), false, i});
    }
    for (std::size_t i = 0; i < grid_.tiles.size(); ++i) {
      if (grid_.tiles[i].dim == 8) parts.push_back({blockOf(grid_.tiles[i].origin, log2_, 8), true, i});
    }
    std::sort(parts.begin(), parts.end());
    std::vector<std::size_t> begins;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (i == 0 || parts[i].block != parts[i - 1].block) begins.push_back(i);
    }
    coarse_.leaves.resize(begins.size());
    parallelRanges(begins.size(), 16, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) {
        const std::size_t end = i + 1 < begins.size() ? begins[i + 1] : parts.size();
        makeLeaf(std::span(parts).subspan(begins[i], end - begins[i]), coarse_.leaves[i]);
      }
    });
  }

  void makeLeaf(std::span<const Part> parts, Leaf& out) const {
    out.origin = parts.front().block;
    std::array<double, format::kBrickVoxels> sums{};
    std::array<std::uint32_t, format::kBrickVoxels> counts{};  // active voxels
    for (const Part& part : parts) {
      const Leaf* leaf = part.tile ? nullptr : &grid_.leaves[part.index];
      const Origin& origin = part.tile ? grid_.tiles[part.index].origin : leaf->origin;
      const float constant = part.tile ? grid_.tiles[part.index].value : 0;
      std::array<std::uint32_t, 3> corner{};
      for (std::size_t a = 0; a < 3; ++a) corner[a] = static_cast<std::uint32_t>((origin[a] >> log2_) & 7);
      for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
        if (leaf != nullptr && !format::maskBit(leaf->active, i)) continue;
        const std::uint32_t x = corner[0] + ((i >> 6) >> log2_), y = corner[1] + ((i >> 3 & 7) >> log2_),
                            z = corner[2] + ((i & 7) >> log2_);
        const std::uint32_t voxel = x << 6 | y << 3 | z;
        sums[voxel] += static_cast<double>(leaf != nullptr ? leaf->values[i] : constant);
        ++counts[voxel];
      }
    }
    finishLeaf(sums, counts, out);
  }

  void finishLeaf(const std::array<double, format::kBrickVoxels>& sums,
                  const std::array<std::uint32_t, format::kBrickVoxels>& counts, Leaf& out) const {
    const std::uint32_t all = 1u << (3 * log2_);
    const auto background = static_cast<double>(grid_.background);
    out.active = {};
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      out.values[i] = grid_.background;
      if (counts[i] == 0) continue;
      out.active.words[i >> 5] |= 1u << (i & 31);
      out.values[i] = static_cast<float>((sums[i] + background * (all - counts[i])) / all);
    }
  }

  void makeTiles() {
    std::vector<Part> parts;
    for (std::size_t i = 0; i < grid_.tiles.size(); ++i) {
      const Tile& tile = grid_.tiles[i];
      if (tile.dim == format::kIndexSpan) {
        const auto side = static_cast<std::int32_t>(tile.dim >> log2_);
        cut(tile.origin, side, 128, tile.value);
      } else if (tile.dim == 128) {
        parts.push_back({blockOf(tile.origin, log2_, 128), true, i});
      }
    }
    std::sort(parts.begin(), parts.end());
    for (std::size_t i = 0, end = 0; i < parts.size(); i = end) {
      while (end < parts.size() && parts[end].block == parts[i].block) ++end;
      joinTiles(std::span(parts).subspan(i, end - i));
    }
  }

  // Those of one block of 128^3: one tile where all of it has one value, else many small ones.
  void joinTiles(std::span<const Part> parts) {
    const float value = grid_.tiles[parts.front().index].value;
    const bool whole =
        parts.size() == std::size_t{1} << (3 * log2_) && std::ranges::all_of(parts, [&](const Part& part) {
          return std::bit_cast<std::uint32_t>(grid_.tiles[part.index].value) == std::bit_cast<std::uint32_t>(value);
        });
    if (whole) {
      coarse_.tiles.push_back({parts.front().block, 128, value});
      return;
    }
    for (const Part& part : parts) {
      cut(grid_.tiles[part.index].origin, 128 >> log2_, 8, grid_.tiles[part.index].value);
    }
  }

  // A cube of `side` coarse voxels, from a fine origin, as tiles of `dim`.
  void cut(const Origin& fine, std::int32_t side, std::int32_t dim, float value) {
    const Origin first{fine[0] >> log2_, fine[1] >> log2_, fine[2] >> log2_};
    for (std::int32_t x = 0; x < side; x += dim) {
      for (std::int32_t y = 0; y < side; y += dim) {
        for (std::int32_t z = 0; z < side; z += dim) {
          coarse_.tiles.push_back({{first[0] + x, first[1] + y, first[2] + z}, static_cast<std::uint32_t>(dim), value});
        }
      }
    }
  }

  void measure() {
    const auto grow = [&](float value) {
      coarse_.min = std::min(coarse_.min, value);
      coarse_.max = std::max(coarse_.max, value);
    };
    for (const Tile& tile : coarse_.tiles) {
      coarse_.activeVoxels += std::uint64_t{tile.dim} * tile.dim * tile.dim;
      grow(tile.value);
    }
    for (const Leaf& leaf : coarse_.leaves) {
      for (const std::uint32_t word : leaf.active.words) {
        coarse_.activeVoxels += static_cast<std::uint64_t>(std::popcount(word));
      }
      std::ranges::for_each(leaf.values, grow);  // inactive ones are the background
    }
  }

  const ImportedGrid& grid_;
  const std::uint32_t log2_;
  ImportedGrid coarse_;
};

}  // namespace

ImportedGrid coarsen(const ImportedGrid& grid, std::uint32_t log2) {
  return grid.present ? Coarsening(grid, log2).run() : grid;
}

}  // namespace billow::compiler
