// What a parent must know of a brick: its values' range, its active voxels and their box.
#ifndef BILLOW_FORMAT_SRC_BRICK_FACTS_H
#define BILLOW_FORMAT_SRC_BRICK_FACTS_H

#include <array>
#include <cstdint>

#include "billow/format/brick.h"

namespace billow::format {

// H of the standard: what the largest texel stands for.
float largestValue(const Node3& node);

struct BrickFacts {
  float min = 0, max = 0;
  std::uint16_t active = 0;
  bool exact = false;                         // min and max are of its values, not only of what it can hold
  std::array<std::uint8_t, 3> low{}, high{};  // of active voxels, inclusive

  // Number and box of the active voxels.
  void measureActive(const Mask3& mask);
  // Bounds that need no decoding: what the brick can hold at most, by `active`. Mostly they do.
  void boundValues(const Node3& node, float background);
  // The range of decoded values.
  void measureValues(const Values& values);
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SRC_BRICK_FACTS_H
