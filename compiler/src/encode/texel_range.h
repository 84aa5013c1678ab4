// From a brick's values to the texel scale on which they are quantised, and back to errors.
#ifndef BILLOW_COMPILER_ENCODE_TEXEL_RANGE_H
#define BILLOW_COMPILER_ENCODE_TEXEL_RANGE_H

#include <array>
#include <cstdint>

#include "stages.h"

namespace billow::compiler {

struct ValueRange {
  float min = 0, max = 0;
};

// The map texel -> value of a candidate: values are lo + scale * texel.
struct TexelRange {
  float lo = 0;
  float scale = 0;
};
// Texels [first, last] cover [range.min, range.max], as far as single precision can: a range over FLT_MAX cannot be
// covered and is cut above. scale is 0 where the range is empty. lo may be -infinity where `first` is not 0.
TexelRange coverRange(ValueRange range, std::uint32_t first, std::uint32_t last);

// The same numbers with as many low bits of their mantissas 0, up to 16, as move no value lo + scale * [0, last] by
// more than `tolerance`: they weigh less on disk. `lo` and `lo + scale * last` are finite in single precision.
TexelRange shorten(double lo, double scale, std::uint32_t last, double tolerance);
// As shorten() of a single number.
float shorten(double value, double tolerance);

// By voxelIndex: where a voxel's value lies in the texel scale, and 1 for an active voxel, 0 for an inactive one.
using TexelTargets = std::array<float, format::kBrickVoxels>;
using TexelWeights = std::array<float, format::kBrickVoxels>;

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_TEXEL_RANGE_H
