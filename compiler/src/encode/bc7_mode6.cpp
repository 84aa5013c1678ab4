// Mode 6: one line, 16 steps, ends of seven bits and a p-bit. The mode that most smooth blocks want.
#include <initializer_list>

#include "encode/bc7_lines.h"

namespace billow::compiler {
namespace {

constexpr float kLevels = 15.0f;

// Moves every channel of both ends by one stored step (two, as the p-bit stays) while that helps.
void nudgeEnds(const Plane& plane, LineFit& best) {
  for (int pass = 0; pass < 3; ++pass) {
    const float before = best.error;
    for (int c = 0; c < 4; ++c) {
      for (const float by : {-2.0f, 2.0f}) {
        Float4 change = splat(0);
        change[c] = by;
        for (const bool atFirst : {true, false}) {
          Line line = best.line;
          Float4& end = atFirst ? line.first : line.second;
          end += change;
          if (end[c] >= 0.0f && end[c] <= 255.0f) tryLine(plane, line, kLevels, best);
        }
      }
    }
    if (!(best.error < before)) break;
  }
}

}  // namespace

Bc7Fit fitMode6(const Plane& plane, const Bc7Search& search) {
  LineFit best = fitLineWithP<8>(plane, kLevels, search);
  if (search.nudge) nudgeEnds(plane, best);
  Bc7Fit fit;
  fit.mode = 6;
  fit.line[0] = best.line;
  fit.steps = best.steps;
  fit.error = best.error;
  return fit;
}

}  // namespace billow::compiler
