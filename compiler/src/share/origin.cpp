#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "share/share.h"

namespace billow::compiler {
namespace {

std::int64_t floorTo(std::int64_t value, std::int64_t step) {
  const std::int64_t down = value / step * step;
  return down > value ? down - step : down;
}

// By axis the coordinates at which a voxel is active, as bits.
using Occupied = std::array<std::uint32_t, 3>;

// Two words an x, four ys a word, eight zs a byte.
Occupied occupiedBy(const format::Mask3& active) {
  Occupied occupied = {};
  for (std::uint32_t w = 0; w < 16; ++w) {
    const std::uint32_t word = active.words[w];
    if (word == 0) continue;
    occupied[0] |= 1u << (w >> 1);
    for (std::uint32_t y = 0; y < 4; ++y) {
      const std::uint32_t row = word >> (8 * y) & 0xff;
      if (row != 0) occupied[1] |= 1u << (4 * (w & 1) + y);
      occupied[2] |= row;
    }
  }
  return occupied;
}

}  // namespace

void activeBox(const ImportedGrid& grid, std::array<std::int64_t, 3>& min, std::array<std::int64_t, 3>& max) {
  min.fill(std::numeric_limits<std::int64_t>::max());
  max.fill(std::numeric_limits<std::int64_t>::min());
  const auto grow = [&](std::size_t axis, std::int64_t low, std::int64_t high) {
    min[axis] = std::min(min[axis], low);
    max[axis] = std::max(max[axis], high);
  };
  for (const Tile& tile : grid.tiles) {
    for (std::size_t a = 0; a < 3; ++a) grow(a, tile.origin[a], std::int64_t{tile.origin[a]} + tile.dim - 1);
  }
  for (const Leaf& leaf : grid.leaves) {
    const Occupied occupied = occupiedBy(leaf.active);
    for (std::size_t a = 0; a < 3; ++a) {
      if (occupied[a] == 0) continue;
      grow(a, std::int64_t{leaf.origin[a]} + std::countr_zero(occupied[a]),
           std::int64_t{leaf.origin[a]} + std::bit_width(occupied[a]) - 1);
    }
  }
}

std::array<std::int32_t, 3> chooseOrigin(const std::array<std::int64_t, 3>& min, const std::array<std::int64_t, 3>& max,
                                         const std::string& where) {
  std::array<std::int32_t, 3> origin{};
  for (std::size_t a = 0; a < 3; ++a) {
    bool fits = false;
    for (const std::int64_t step : {4096, 128, 8}) {
      const std::int64_t low = floorTo(min[a], step);
      if (max[a] - low >= format::kIndexSpan) continue;
      origin[a] = static_cast<std::int32_t>(low);
      fits = true;
      break;
    }
    if (!fits) {
      throw Error(Fault::input,
                  fmt::format("{}: active voxels reach from {} to {} along {}; a grid may span {} voxels a frame: crop "
                              "it, or split it into several grids",
                              where, min[a], max[a], "xyz"[a], format::kIndexSpan));
    }
  }
  return origin;
}

// Pack index p is source index p + origin: the translation moves into the matrix.
void placeOrigin(const std::array<double, 12>& sourceToWorld, format::GridFrame& record) {
  std::copy(sourceToWorld.begin(), sourceToWorld.end(), record.indexToWorld);
  for (std::size_t row = 0; row < 3; ++row) {
    double* m = record.indexToWorld + 4 * row;
    m[3] += m[0] * record.origin[0] + m[1] * record.origin[1] + m[2] * record.origin[2];
  }
}

}  // namespace billow::compiler
