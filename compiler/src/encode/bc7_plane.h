// Fitting 16 texels of four channels by a line of evenly spaced steps: what all BC7 modes have in common. A weight of 0
// takes a channel of a texel out of the fit: inactive voxels, the texels of another subset, a channel of its own.
#ifndef BILLOW_COMPILER_ENCODE_BC7_PLANE_H
#define BILLOW_COMPILER_ENCODE_BC7_PLANE_H

#include "encode/lanes.h"

namespace billow::compiler {

struct Plane {
  Float4 value[4][4];   // [channel][texel / 4][texel % 4], in [0, 255]
  Float4 weight[4][4];  // 0 or 1
  bool uniform;         // a texel's four weights are equal
};

// Two colours, one channel a lane.
struct Line {
  Float4 first, second;
};

// Numbers of steps along a line, [texel / 4][texel % 4].
struct Steps {
  Float4 step[4];
};

// The principal axis through the texels, from the lowest to the highest of their projections. Clamped to [0, 255].
Line principalLine(const Plane& plane);

// For each texel the step of [0, levels] nearest to it.
Steps nearestSteps(const Plane& plane, const Line& line, float levels);

// The line that fits best where each texel keeps its step; `fallback` in channels where that is undetermined.
// Clamped to [0, 255].
Line leastSquaresLine(const Plane& plane, const Steps& steps, float levels, const Line& fallback);

// The squared error of a line with integer ends as the decoder interpolates it, by channel.
Float4 lineErrors(const Plane& plane, const Line& line, const Steps& steps, float levels);

// Per channel the number of texels with weight.
Float4 channelCounts(const Plane& plane);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_BC7_PLANE_H
