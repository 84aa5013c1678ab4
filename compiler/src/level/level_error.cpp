#include "level/level_error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "metric/cell_lookup.h"
#include "parallel.h"

namespace billow::compiler {
namespace {

// A cell of 8^3 level voxels and one more around it.
constexpr std::size_t kApron = 10;
using Apron = std::array<float, kApron * kApron * kApron>;

// What a cell, of a leaf's size, holds.
struct CellView {
  const Leaf* leaf = nullptr;
  const Tile* tile = nullptr;

  CellView(const CellLookup& lookup, const Origin& cell) : leaf(lookup.leafAt(cell)) {
    if (leaf == nullptr) tile = lookup.tileOver(cell, 8);
  }
  bool empty() const { return leaf == nullptr && tile == nullptr; }
  float value(std::size_t voxel, float background) const {
    return leaf != nullptr ? leaf->values[voxel] : tile != nullptr ? tile->value : background;
  }
  std::uint64_t activeVoxels() const {
    if (leaf == nullptr) return tile != nullptr ? format::kBrickVoxels : 0;
    std::uint64_t count = 0;
    for (const std::uint32_t word : leaf->active.words) count += static_cast<std::uint64_t>(std::popcount(word));
    return count;
  }
};

class Measurement {
 public:
  Measurement(const ImportedGrid& source, const ImportedGrid& level, std::uint32_t log2)
      : source_(source), level_(level), background_(level.background), log2_(static_cast<std::int32_t>(log2)) {
    setTaps();
  }

  LevelDifference run(const ImportedGrid& level) {
    std::vector<Origin> cells;
    for (const Leaf& leaf : level.leaves) addShell(leaf.origin, 8, cells);
    for (const Tile& tile : level.tiles) addShell(tile.origin, static_cast<std::int32_t>(tile.dim), cells);
    std::ranges::sort(cells);
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    add(cells.size(), [&](std::size_t i) { return measureCell(cells[i]); });
    for (const Tile& tile : level.tiles) addInterior(tile);
    sum_.missed = source_.activeVoxels() - visited_;
    return sum_;
  }

 private:
  struct Part {
    double squaredError = 0, maxError = 0;
    std::uint64_t visited = 0;  // active voxels of the source

    void add(double difference, std::uint64_t voxels) {
      squaredError += difference * difference * static_cast<double>(voxels);
      maxError = std::max(maxError, std::abs(difference));
    }
  };

  // Parts are summed in their order, whatever threads measure them.
  template <class MeasureOne>
  void add(std::size_t count, const MeasureOne& measureOne) {
    std::vector<Part> parts(count);
    parallelRanges(count, 64, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) parts[i] = measureOne(i);
    });
    for (const Part& part : parts) {
      sum_.squaredError += part.squaredError;
      sum_.maxError = std::max(sum_.maxError, part.maxError);
      visited_ += part.visited;
    }
  }

  // Of a fine voxel along one axis of a brick: the first of two level voxels in the brick's window, which begins one
  // before those that the brick lies in, and the second's weight. Both exact, so that between equal values nothing is
  // lost.
  struct Tap {
    std::size_t first;
    double weight;
  };
  void setTaps() {
    const std::size_t factor = std::size_t{1} << log2_;
    for (std::size_t i = 0; i < 8; ++i) {
      const std::size_t twice = 2 * i + 1 + factor;  // of the place, in halves of a fine voxel
      taps_[i] = {twice / (2 * factor), static_cast<double>(twice % (2 * factor)) / static_cast<double>(2 * factor)};
    }
  }

  // Cells in which a cube of one value, or none, is not alone within reach of their voxels.
  static void addShell(const Origin& origin, std::int32_t dim, std::vector<Origin>& cells) {
    const std::int32_t side = dim / 8;
    const auto rim = [&](std::int32_t at) { return at <= 0 || at >= side - 1; };
    for (std::int32_t x = -1; x <= side; ++x) {
      for (std::int32_t y = -1; y <= side; ++y) {
        const bool all = rim(x) || rim(y);
        for (std::int32_t z = -1; z <= side; z += all || z < 0 || side <= 2 ? 1 : side - 1) {
          if (all || rim(z)) cells.push_back({origin[0] + 8 * x, origin[1] + 8 * y, origin[2] + 8 * z});
        }
      }
    }
  }

  // Whether a cell's value is that of all cells around, in tiles.
  bool isInside(const Origin& cell, float value) const {
    for (std::int32_t n = 0; n < 27; ++n) {
      const Tile* tile =
          level_.tileOver({cell[0] + 8 * (n / 9 - 1), cell[1] + 8 * (n / 3 % 3 - 1), cell[2] + 8 * (n % 3 - 1)}, 8);
      if (tile == nullptr || std::bit_cast<std::uint32_t>(tile->value) != std::bit_cast<std::uint32_t>(value)) {
        return false;
      }
    }
    return true;
  }

  // The rest of a tile, where no other value is within reach.
  void addInterior(const Tile& tile) {
    const std::size_t side = tile.dim / 8;
    if (side <= 2) return;
    const std::size_t inner = side - 2;
    add(inner * inner * inner, [&](std::size_t i) {
      const std::size_t at[3] = {i / (inner * inner), i / inner % inner, i % inner};
      Origin cell{};
      for (std::size_t a = 0; a < 3; ++a) cell[a] = tile.origin[a] + 8 * static_cast<std::int32_t>(at[a] + 1);
      return measureConstant(cell, tile.value);
    });
  }

  Part measureConstant(const Origin& cell, float value) const {
    Part part;
    const Origin fine = fineOrigin(cell);
    const auto edge = std::uint32_t{8} << log2_;
    if (const Tile* tile = source_.tileOver(fine, edge)) {
      part.visited = std::uint64_t{edge} * edge * edge;
      part.add(static_cast<double>(value) - static_cast<double>(tile->value), part.visited);
      return part;
    }
    Apron apron;
    apron.fill(value);
    measureBricks(fine, apron, part);
    return part;
  }

  Part measureCell(const Origin& cell) const {
    Part part;
    if (const Tile* tile = level_.tileOver(cell, 8); tile != nullptr && isInside(cell, tile->value)) {
      return measureConstant(cell, tile->value);
    }
    Apron apron;
    if (gather(cell, apron)) measureBricks(fineOrigin(cell), apron, part);
    return part;
  }

  // A cell beside the last that 32 bits hold comes out far from all that the source has.
  static std::int32_t wrapped(std::uint32_t at) { return static_cast<std::int32_t>(at); }
  Origin fineOrigin(const Origin& cell) const {
    Origin fine{};
    for (std::size_t a = 0; a < 3; ++a) fine[a] = wrapped(static_cast<std::uint32_t>(cell[a]) << log2_);
    return fine;
  }

  // False where the level is the background all over it; then the source has nothing in the cell either.
  bool gather(const Origin& cell, Apron& apron) const {
    bool any = false;
    for (std::size_t n = 0; n < 27; ++n) {
      const std::size_t block[3] = {n / 9, n / 3 % 3, n % 3};
      Origin at{};
      for (std::size_t a = 0; a < 3; ++a) at[a] = cell[a] + 8 * (static_cast<std::int32_t>(block[a]) - 1);
      const CellView view(level_, at);
      any |= !view.empty();
      // Of the cells around, the one layer that touches.
      std::size_t begin[3], end[3];
      for (std::size_t a = 0; a < 3; ++a) {
        begin[a] = block[a] == 0 ? 0 : block[a] == 1 ? 1 : 9;
        end[a] = block[a] == 0 ? 1 : block[a] == 1 ? 9 : 10;
      }
      for (std::size_t x = begin[0]; x < end[0]; ++x) {
        for (std::size_t y = begin[1]; y < end[1]; ++y) {
          for (std::size_t z = begin[2]; z < end[2]; ++z) {
            const std::size_t voxel = (x + 7) % 8 * 64 + (y + 7) % 8 * 8 + (z + 7) % 8;
            apron[(x * kApron + y) * kApron + z] = view.value(voxel, background_);
          }
        }
      }
    }
    return any;
  }

  // The fine bricks of a cell.
  void measureBricks(const Origin& fine, const Apron& apron, Part& part) const {
    const std::size_t bricks = std::size_t{1} << log2_;
    std::array<double, format::kBrickVoxels> values;
    for (std::size_t n = 0; n < bricks * bricks * bricks; ++n) {
      const std::size_t at[3] = {n / (bricks * bricks), n / bricks % bricks, n % bricks};
      Origin origin{};
      for (std::size_t a = 0; a < 3; ++a)
        origin[a] = wrapped(static_cast<std::uint32_t>(fine[a]) + 8 * static_cast<std::uint32_t>(at[a]));
      const CellView source(source_, origin);
      upsample(apron, at, values);
      part.visited += source.activeVoxels();
      for (std::size_t i = 0; i < values.size(); ++i) {
        part.add(values[i] - static_cast<double>(source.value(i, background_)), 1);
      }
    }
  }

  static double between(double a, double b, double weight) { return a * (1 - weight) + b * weight; }

  // Linear along z, then y, then x, in the window of level voxels around one fine brick.
  void upsample(const Apron& apron, const std::size_t (&brick)[3],
                std::array<double, format::kBrickVoxels>& out) const {
    const std::size_t covered = std::size_t{8} >> log2_, window = covered + 2;  // at most 6
    std::array<double, 6 * 6 * 8> alongZ;
    std::array<double, 6 * 8 * 8> alongY;
    for (std::size_t x = 0; x < window; ++x) {
      for (std::size_t y = 0; y < window; ++y) {
        const float* row =
            &apron[((brick[0] * covered + x) * kApron + brick[1] * covered + y) * kApron + brick[2] * covered];
        for (std::size_t z = 0; z < 8; ++z) {
          const Tap& tap = taps_[z];
          alongZ[(x * 6 + y) * 8 + z] =
              between(static_cast<double>(row[tap.first]), static_cast<double>(row[tap.first + 1]), tap.weight);
        }
      }
      for (std::size_t y = 0; y < 8; ++y) {
        const double* rows = &alongZ[(x * 6 + taps_[y].first) * 8];
        for (std::size_t z = 0; z < 8; ++z)
          alongY[(x * 8 + y) * 8 + z] = between(rows[z], rows[z + 8], taps_[y].weight);
      }
    }
    for (std::size_t x = 0; x < 8; ++x) {
      const double* plane = &alongY[taps_[x].first * 64];
      for (std::size_t i = 0; i < 64; ++i) out[x * 64 + i] = between(plane[i], plane[i + 64], taps_[x].weight);
    }
  }

  const CellLookup source_, level_;
  const float background_;
  const std::int32_t log2_;
  std::array<Tap, 8> taps_{};
  LevelDifference sum_;
  std::uint64_t visited_ = 0;
};

}  // namespace

LevelDifference measureLevel(const ImportedGrid& source, const ImportedGrid& level, std::uint32_t log2) {
  return Measurement(source, level, log2).run(level);
}

}  // namespace billow::compiler
