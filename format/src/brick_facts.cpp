#include "brick_facts.h"

#include <algorithm>
#include <bit>

namespace billow::format {

float largestValue(const Node3& node) {
  return reconstruct(node.lo, node.scale, largestTexel(encodingOf(node)));
}

void BrickFacts::measureActive(const Mask3& mask) {
  std::uint32_t even = 0, odd = 0, slabs = 0, count = 0;
  for (std::uint32_t x = 0; x < 8; ++x) {
    even |= mask.words[2 * x];
    odd |= mask.words[2 * x + 1];
    count += static_cast<std::uint32_t>(std::popcount(mask.words[2 * x]) + std::popcount(mask.words[2 * x + 1]));
    if ((mask.words[2 * x] | mask.words[2 * x + 1]) != 0) slabs |= 1u << x;
  }
  active = static_cast<std::uint16_t>(count);
  if (count == 0) return;
  std::uint32_t rows = 0, columns = 0;
  for (std::uint32_t y = 0; y < 8; ++y) {
    const std::uint32_t row = (y < 4 ? even : odd) >> (8 * (y & 3)) & 0xffu;
    columns |= row;
    if (row != 0) rows |= 1u << y;
  }
  const std::uint32_t axes[3] = {slabs, rows, columns};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = static_cast<std::uint8_t>(std::countr_zero(axes[axis]));
    high[axis] = static_cast<std::uint8_t>(31 - std::countl_zero(axes[axis]));
  }
}

void BrickFacts::boundValues(const Node3& node, float background) {
  const float highest = largestValue(node);
  const bool none = active == 0, all = active == kBrickVoxels;
  min = none ? background : all ? node.lo : std::min(node.lo, background);
  max = none ? background : all ? highest : std::max(highest, background);
  exact = none || encodingOf(node) == kEncodingConstant;
}

void BrickFacts::measureValues(const Values& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  min = *least;
  max = *most;
  exact = true;
}

}  // namespace billow::format
