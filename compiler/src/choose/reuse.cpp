#include "choose/reuse.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace billow::compiler {
namespace {

static_assert(sizeof(Leaf) == 12 + sizeof(format::Mask3) + sizeof(format::Values), "Leaf has no padding");

bool sameMask(const format::Mask3& a, const format::Mask3& b) {
  return std::memcmp(&a, &b, sizeof(a)) == 0;
}

// Calls match(i, j) for each before[i] and now[j] at one place; both ascend.
template <class Before, class Now, class Match>
void matchPlaces(const Before& before, const Now& now, const Match& match) {
  std::size_t i = 0;
  for (std::size_t j = 0; j < now.size(); ++j) {
    while (i < before.size() && before[i].origin < now[j].origin) ++i;
    if (i < before.size() && before[i].origin == now[j].origin) match(i, j);
  }
}

}  // namespace

std::vector<LeafKey> leafKeys(const ImportedGrid& grid) {
  std::vector<LeafKey> keys;
  keys.reserve(grid.leaves.size());
  for (const Leaf& leaf : grid.leaves) {
    const std::uint64_t mask = XXH3_64bits(&leaf.active, sizeof(leaf.active));
    keys.push_back({leaf.origin, XXH3_64bits_withSeed(leaf.values.data(), sizeof(leaf.values), mask)});
  }
  return keys;
}

std::vector<char> unchangedLeaves(std::span<const LeafKey> before, std::span<const LeafKey> now) {
  std::vector<char> unchanged(now.size());
  matchPlaces(before, now, [&](std::size_t i, std::size_t j) { unchanged[j] = before[i].hash == now[j].hash; });
  return unchanged;
}

void FrameBefore::keep(const ImportedGrid& grid, const ChosenGrid& chosen) {
  std::vector<Stored> bricks;
  bricks.reserve(grid.leaves.size());
  for (std::size_t i = 0; i < grid.leaves.size(); ++i) {
    bricks.push_back({grid.leaves[i].origin, grid.leaves[i].active, chosen.bricks[i]});
  }
  bricks_ = std::move(bricks);
}

std::vector<const ChosenBrick*> FrameBefore::candidates(const ImportedGrid& grid) const {
  std::vector<const ChosenBrick*> found(grid.leaves.size());
  matchPlaces(bricks_, grid.leaves, [&](std::size_t i, std::size_t j) {
    if (sameMask(bricks_[i].active, grid.leaves[j].active)) found[j] = &bricks_[i].brick;
  });
  return found;
}

Fit measureReuse(const ChosenBrick& stored, const Leaf& leaf, float background, format::Values& errors) {
  format::Node3 node{};
  node.brick = stored.encoding << format::kEncodingShift;
  node.mask = stored.texelMask ? format::kMaskTexel : 0;
  node.lo = stored.lo;
  node.scale = stored.scale;
  format::Mask3 active;
  format::decodeBrick(node, &leaf.active, stored.payload, background, errors, active);
  Fit fit{stored.encoding, stored.texelMask, stored.lo, stored.scale, 0, 0};
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    errors[v] = format::maskBit(active, v) ? errors[v] - leaf.values[v] : 0;
    fit.squaredError += static_cast<double>(errors[v]) * static_cast<double>(errors[v]);
    fit.maxError = std::max(fit.maxError, std::fabs(errors[v]));
  }
  return fit;
}

}  // namespace billow::compiler
