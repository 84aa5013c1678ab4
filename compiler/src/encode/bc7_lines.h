// The search that modes 6 and 7 share: one line through all four channels, ends with p-bits.
#ifndef BILLOW_COMPILER_ENCODE_BC7_LINES_H
#define BILLOW_COMPILER_ENCODE_BC7_LINES_H

#include "encode/bc7_block.h"
#include "encode/bc7_ends.h"

namespace billow::compiler {

struct LineFit {
  Line line = {};
  Steps steps = {};
  float error = 1e30f;
};

// Takes `line`, whose ends can be stored, where it is better than `best`.
inline void tryLine(const Plane& plane, const Line& line, float levels, LineFit& best) {
  const Steps steps = nearestSteps(plane, line, levels);
  const float error = sum(lineErrors(plane, line, steps, levels));
  if (error < best.error) best = {line, steps, error};
}

// Bits: of an end with its p-bit.
template <int Bits>
LineFit fitLineWithP(const Plane& plane, float levels, const Bc7Search& search) {
  LineFit best;
  const Float4 counts = channelCounts(plane);
  Line line = principalLine(plane);
  Steps steps = nearestSteps(plane, line, levels);
  for (int pass = 0; pass < search.passes; ++pass) {
    line = leastSquaresLine(plane, steps, levels, line);
    const float before = best.error;
    tryLine(plane, {quantiseEndWithBestP<Bits>(line.first, counts), quantiseEndWithBestP<Bits>(line.second, counts)},
            levels, best);
    if (!(best.error < before)) break;
    steps = best.steps;
  }
  if (search.allPBits) {
    for (int combination = 0; combination < 4; ++combination) {
      const auto firstP = static_cast<float>(combination & 1);
      const auto secondP = static_cast<float>(combination >> 1);
      tryLine(plane, {quantiseEndWithP<Bits>(line.first, firstP), quantiseEndWithP<Bits>(line.second, secondP)}, levels,
              best);
    }
  }
  return best;
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_BC7_LINES_H
