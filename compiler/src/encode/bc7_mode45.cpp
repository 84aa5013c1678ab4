// Modes 4 and 5: one line through three channels, the fourth on its own. For blocks with one slice unlike the others.
#include <utility>

#include "encode/bc7_block.h"
#include "encode/bc7_ends.h"
#include "encode/scalar_fit.h"

namespace billow::compiler {
namespace {

struct ColorFit {
  Line line = {};
  Steps steps = {};
  float error = 1e30f;
};

template <int Bits>
ColorFit fitColor(const Plane& color, float levels, int passes) {
  ColorFit best;
  Line line = principalLine(color);
  Steps steps = nearestSteps(color, line, levels);
  for (int pass = 0; pass < passes; ++pass) {
    line = leastSquaresLine(color, steps, levels, line);
    const Line stored = {quantiseEnd<Bits>(line.first), quantiseEnd<Bits>(line.second)};
    steps = nearestSteps(color, stored, levels);
    const float error = sum(lineErrors(color, stored, steps, levels));
    if (!(error < best.error)) break;
    best = {stored, steps, error};
  }
  return best;
}

struct SeparateFit {
  Segment segment = {};
  Steps steps = {};
  float error = 1e30f;
};

template <int Bits>
SeparateFit fitSeparate(const Scalars& scalars, float levels, int passes) {
  SeparateFit best;
  Segment segment = scalarRange(scalars);
  for (int pass = 0; pass < passes; ++pass) {
    const Float4 ends = quantiseEnd<Bits>(clamp(Float4{segment.first, segment.second, 0, 0}, 0.0f, 255.0f));
    const Segment stored = {ends[0], ends[1]};
    Steps steps;
    scalarSteps(scalars, stored, levels, steps.step);
    Float4 position[4];
    Float4 error = splat(0);
    for (int r = 0; r < 4; ++r) {
      const Float4 weight = round(steps.step[r] * splat(64.0f / levels));
      const Float4 blend = splat(stored.first) * splat(64.0f) + weight * splat(stored.second - stored.first);
      const Float4 difference = truncate((blend + splat(32.0f)) * splat(1.0f / 64.0f)) - scalars.value[r];
      error += difference * difference * scalars.weight[r];
      position[r] = weight * splat(1.0f / 64.0f);
    }
    const float total = sum(error);
    if (!(total < best.error)) break;
    best = {stored, steps, total};
    segment = scalarLeastSquares(scalars, position, segment);
  }
  return best;
}

// Channel 3 of a rotated plane as scalars, and the plane without it: a channel of zeros costs nothing.
struct Split {
  Plane color;
  Scalars separate;

  Split(const Plane& plane, std::uint32_t rotation) : color(plane) {
    const std::uint32_t channel = rotation == 0 ? 3 : rotation - 1;
    for (int r = 0; r < 4; ++r) {
      separate.value[r] = plane.value[channel][r];
      separate.weight[r] = plane.weight[channel][r];
      color.value[channel][r] = plane.value[3][r];
      color.weight[channel][r] = plane.weight[3][r];
      color.value[3][r] = splat(0);
      color.weight[3][r] = plane.weight[channel][r];
    }
  }
};

void keepBetter(std::uint32_t mode, std::uint32_t rotation, bool colorIsSecond, const ColorFit& color,
                const SeparateFit& separate, Bc7Fit& best) {
  const float error = color.error + separate.error;
  if (!(error < best.error)) return;
  best.mode = mode;
  best.partition = 0;
  best.rotation = rotation;
  best.colorIsSecond = colorIsSecond;
  best.line[0] = color.line;
  best.line[0].first[3] = separate.segment.first;
  best.line[0].second[3] = separate.segment.second;
  best.steps = color.steps;
  best.separateSteps = separate.steps;
  best.error = error;
}

void tryRotation(const Plane& plane, std::uint32_t rotation, const Bc7Search& search, Bc7Fit& best) {
  const Split split(plane, rotation);
  keepBetter(5, rotation, false, fitColor<7>(split.color, 3, search.passes),
             fitSeparate<8>(split.separate, 3, search.passes), best);
  if (!search.mode4) return;
  keepBetter(4, rotation, false, fitColor<5>(split.color, 3, search.passes),
             fitSeparate<6>(split.separate, 7, search.passes), best);
  keepBetter(4, rotation, true, fitColor<5>(split.color, 7, search.passes),
             fitSeparate<6>(split.separate, 3, search.passes), best);
}

}  // namespace

void tryModes4And5(const Plane& plane, const Bc7Search& search, Bc7Fit& best) {
  if (search.rotations >= 4) {
    for (std::uint32_t rotation = 0; rotation < 4; ++rotation) tryRotation(plane, rotation, search, best);
    return;
  }
  // The channel that one line serves worst is the one to take out.
  const Float4 errors = lineErrors(plane, best.line[0], best.steps, 15.0f);
  std::uint32_t worst = 0;
  for (std::uint32_t c = 1; c < 4; ++c) {
    if (errors[c] > errors[worst]) worst = c;
  }
  tryRotation(plane, worst == 3 ? 0 : worst + 1, search, best);
}

}  // namespace billow::compiler
