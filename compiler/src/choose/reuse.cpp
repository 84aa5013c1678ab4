#include "choose/reuse.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "choose/decode_stored.h"
#include "encode/error_sums.h"

namespace billow::compiler {
namespace {

static_assert(offsetof(Leaf, values) == offsetof(Leaf, active) + sizeof(format::Mask3), "Leaf has no padding");

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

Hash128 hashOf(std::span<const std::byte> bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return {hash.low64, hash.high64};
}

std::vector<LeafKey> leafKeys(const ImportedGrid& grid) {
  constexpr std::size_t kContent = sizeof(Leaf::active) + sizeof(Leaf::values);
  std::vector<LeafKey> keys;
  keys.reserve(grid.leaves.size());
  for (const Leaf& leaf : grid.leaves) {
    const auto* content = reinterpret_cast<const std::byte*>(&leaf.active);
    keys.push_back({leaf.origin, hashOf({content, kContent})});
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
  decodeStored(stored, leaf.active, background, errors);
  Fit fit{stored.encoding, stored.texelMask, stored.lo, stored.scale, 0, 0};
  double largest = 0;
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    // In double: the difference of any two floats is finite there.
    const double error =
        format::maskBit(leaf.active, v) ? static_cast<double>(errors[v]) - static_cast<double>(leaf.values[v]) : 0;
    fit.squaredError += error * error;
    largest = std::max(largest, std::fabs(error));
    errors[v] = static_cast<float>(error);
  }
  fit.maxError = roundUp(largest);
  return fit;
}

}  // namespace billow::compiler
