// The loops of uniform bricks over active voxels, with what SIMD the machine has and the same bits on every one.
#ifndef BILLOW_COMPILER_ENCODE_UNIFORM_LANES_H
#define BILLOW_COMPILER_ENCODE_UNIFORM_LANES_H

#include "encode/active_values.h"

namespace billow::compiler {

// Equally spaced levels on the scale of ActiveValues::place: level i of [0, last] is at first + step * i.
struct Levels {
  float first, step, last;
};

// Of the levels i nearest to the places t: what least squares need.
struct LevelSums {
  double level, levelSquared, product, place, squaredError;
};
LevelSums sumNearest(const ActiveValues& active, const Levels& levels);

// The indices in [first, last] nearest to the values on fit.lo and fit.scale, and the fit's errors with them, by the
// arithmetic of format::reconstruct.
void quantise(const ActiveValues& active, std::uint32_t first, std::uint32_t last, float* indices, Fit& fit);
// The fit's errors with these indices.
void measureIndices(const ActiveValues& active, const float* indices, Fit& fit);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_UNIFORM_LANES_H
