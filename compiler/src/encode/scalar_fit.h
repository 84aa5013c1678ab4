// Fitting 16 weighted scalars by two endpoints and evenly spaced steps between: BC4 blocks, and the separate channel of
// BC7's modes 4 and 5.
#ifndef BILLOW_COMPILER_ENCODE_SCALAR_FIT_H
#define BILLOW_COMPILER_ENCODE_SCALAR_FIT_H

#include "encode/lanes.h"

namespace billow::compiler {

struct Scalars {
  Float4 value[4];   // in [0, 255]
  Float4 weight[4];  // 0 or 1
};

struct Segment {
  float first = 0, second = 0;
};

// The range of the values with weight; both 0 where there is none.
inline Segment scalarRange(const Scalars& scalars) {
  Float4 low = splat(1e30f);
  Float4 high = splat(-1e30f);
  for (int r = 0; r < 4; ++r) {
    const Int4 counts = scalars.weight[r] > splat(0.0f);
    low = min(low, select(counts, scalars.value[r], splat(1e30f)));
    high = max(high, select(counts, scalars.value[r], splat(-1e30f)));
  }
  const Segment range{lowest(low), highest(high)};
  return range.first <= range.second ? range : Segment{};
}

// The step of [0, levels] nearest to each value on the segment.
inline void scalarSteps(const Scalars& scalars, Segment segment, float levels, Float4 steps[4]) {
  const float length = segment.second - segment.first;
  const float scale = length != 0.0f ? levels / length : 0.0f;
  for (int r = 0; r < 4; ++r) {
    steps[r] = round(clamp((scalars.value[r] - splat(segment.first)) * splat(scale), 0.0f, levels));
  }
}

// The segment that fits best when value r stands `position` (in [0, 1]) along it. `fallback` where that is
// undetermined.
inline Segment scalarLeastSquares(const Scalars& scalars, const Float4 position[4], Segment fallback) {
  Float4 a = splat(0), b = splat(0), c = splat(0), p = splat(0), q = splat(0);
  for (int r = 0; r < 4; ++r) {
    const Float4 t = position[r];
    const Float4 s = splat(1.0f) - t;
    const Float4 weightedS = s * scalars.weight[r];
    const Float4 weightedT = t * scalars.weight[r];
    a += weightedS * s;
    b += weightedS * t;
    c += weightedT * t;
    p += weightedS * scalars.value[r];
    q += weightedT * scalars.value[r];
  }
  const Float4 abcp = sums(a, b, c, p);
  const float sumQ = sum(q);
  const float determinant = abcp[0] * abcp[2] - abcp[1] * abcp[1];
  if (!(determinant > 1e-3f)) return fallback;
  const float inverse = 1.0f / determinant;
  return {(abcp[3] * abcp[2] - sumQ * abcp[1]) * inverse, (sumQ * abcp[0] - abcp[3] * abcp[1]) * inverse};
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_SCALAR_FIT_H
