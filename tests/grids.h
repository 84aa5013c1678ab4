// Imported grids that several tests need.
#ifndef BILLOW_TESTS_GRIDS_H
#define BILLOW_TESTS_GRIDS_H

#include <array>
#include <cstdint>

#include "stages.h"

namespace billow::tests {

// Present, and nothing in it.
inline compiler::ImportedGrid emptyGrid() {
  compiler::ImportedGrid grid;
  grid.present = true;
  return grid;
}

// A ball of 32 voxels across in 64 bricks from `origin` on, most of them partly active. `value(density, brick)` gives a
// voxel's value, with a density from 1 in the middle to 0 at the rim, called in the order of bricks and voxels.
template <class Value>
compiler::ImportedGrid ballGrid(const std::array<std::int32_t, 3>& origin, Value value) {
  compiler::ImportedGrid grid = emptyGrid();
  for (std::int32_t brick = 0; brick < 64; ++brick) {
    const std::array<std::int32_t, 3> corner{(brick >> 4) * 8, (brick >> 2 & 3) * 8, (brick & 3) * 8};
    compiler::Leaf leaf{};
    for (std::size_t axis = 0; axis < 3; ++axis) leaf.origin[axis] = origin[axis] + corner[axis];
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      const auto x = static_cast<float>(corner[0] + static_cast<std::int32_t>(i >> 6)) - 15.5f;
      const auto y = static_cast<float>(corner[1] + static_cast<std::int32_t>(i >> 3 & 7)) - 15.5f;
      const auto z = static_cast<float>(corner[2] + static_cast<std::int32_t>(i & 7)) - 15.5f;
      const float density = 1 - (x * x + y * y + z * z) / 256;
      if (density <= 0) continue;
      leaf.active.words[i >> 5] |= 1u << (i & 31);
      leaf.values[i] = value(density, brick);
    }
    grid.leaves.push_back(leaf);
  }
  return grid;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_GRIDS_H
