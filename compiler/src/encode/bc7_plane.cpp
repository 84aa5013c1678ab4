#include "encode/bc7_plane.h"

namespace billow::compiler {
namespace {

// Sum over the rows of a product of a channel's rows.
Float4 dotRows(const Float4 a[4], const Float4 b[4]) {
  return (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]);
}

Float4 addRows(const Float4 a[4]) {
  return (a[0] + a[1]) + (a[2] + a[3]);
}

// The dominant eigenvector of the deviations' covariance, by power iteration; its largest component is about 1.
Float4 dominantAxis(const Float4 deviation[4][4]) {
  Float4 row[4];
  for (int c = 0; c < 4; ++c) {
    row[c] = sums(dotRows(deviation[c], deviation[0]), dotRows(deviation[c], deviation[1]),
                  dotRows(deviation[c], deviation[2]), dotRows(deviation[c], deviation[3]));
  }
  int start = 0;
  for (int c = 1; c < 4; ++c) {
    if (row[c][c] > row[start][start]) start = c;
  }
  Float4 axis = row[start];
  for (int pass = 0; pass < 4; ++pass) {
    const Float4 magnitude = max(axis, -axis);
    const float largest = highest(magnitude);
    if (!(largest > 1e-12f)) return splat(1.0f);
    axis = axis * splat(1.0f / largest);
    axis = (row[0] * splat(axis[0]) + row[1] * splat(axis[1])) + (row[2] * splat(axis[2]) + row[3] * splat(axis[3]));
  }
  const float largest = highest(max(axis, -axis));
  return largest > 1e-12f ? axis * splat(1.0f / largest) : splat(1.0f);
}

Line clampLine(const Line& line) {
  return {clamp(line.first, 0.0f, 255.0f), clamp(line.second, 0.0f, 255.0f)};
}

struct Projection {
  Float4 along[4];    // dot of deviation and direction, weighted
  Float4 squares[4];  // squared length of the direction in the texel's channels with weight
};

Projection project(const Plane& plane, Float4 origin, Float4 direction) {
  Projection result;
  for (int r = 0; r < 4; ++r) {
    Float4 along = splat(0);
    Float4 squares = splat(0);
    for (int c = 0; c < 4; ++c) {
      const Float4 weighted = plane.weight[c][r] * splat(direction[c]);
      along += weighted * (plane.value[c][r] - splat(origin[c]));
      squares += weighted * splat(direction[c]);
    }
    result.along[r] = along;
    result.squares[r] = squares;
  }
  return result;
}

}  // namespace

Float4 channelCounts(const Plane& plane) {
  return sums(addRows(plane.weight[0]), addRows(plane.weight[1]), addRows(plane.weight[2]), addRows(plane.weight[3]));
}

Line principalLine(const Plane& plane) {
  Float4 totals[4];
  for (int c = 0; c < 4; ++c) totals[c] = dotRows(plane.value[c], plane.weight[c]);
  const Float4 counts = channelCounts(plane);
  const Float4 mean = sums(totals[0], totals[1], totals[2], totals[3]) / max(counts, splat(1.0f));
  Float4 deviation[4][4];
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 4; ++r) deviation[c][r] = (plane.value[c][r] - splat(mean[c])) * plane.weight[c][r];
  }
  const Float4 axis = dominantAxis(deviation);
  const Projection projection = project(plane, mean, axis);
  Float4 low = splat(1e30f);
  Float4 high = splat(-1e30f);
  for (int r = 0; r < 4; ++r) {
    const Int4 counts4 = projection.squares[r] > splat(1e-6f);
    const Float4 position = projection.along[r] / select(counts4, projection.squares[r], splat(1.0f));
    low = min(low, select(counts4, position, splat(1e30f)));
    high = max(high, select(counts4, position, splat(-1e30f)));
  }
  const float from = lowest(low);
  const float to = highest(high);
  if (!(from <= to)) return {splat(0), splat(0)};
  return clampLine({mean + axis * splat(from), mean + axis * splat(to)});
}

Steps nearestSteps(const Plane& plane, const Line& line, float levels) {
  const Projection projection = project(plane, line.first, line.second - line.first);
  Steps steps;
  for (int r = 0; r < 4; ++r) {
    const Int4 counts = projection.squares[r] > splat(1e-6f);
    const Float4 position = projection.along[r] / select(counts, projection.squares[r], splat(1.0f));
    steps.step[r] = round(clamp(select(counts, position, splat(0)) * splat(levels), 0.0f, levels));
  }
  return steps;
}

Line leastSquaresLine(const Plane& plane, const Steps& steps, float levels, const Line& fallback) {
  Float4 t[4], s[4], tt[4], st[4], ss[4];
  for (int r = 0; r < 4; ++r) {
    t[r] = round(steps.step[r] * splat(64.0f / levels)) * splat(1.0f / 64.0f);
    s[r] = splat(1.0f) - t[r];
    tt[r] = t[r] * t[r];
    st[r] = s[r] * t[r];
    ss[r] = s[r] * s[r];
  }
  Float4 p[4], q[4];
  for (int c = 0; c < 4; ++c) {
    Float4 weighted[4];
    for (int r = 0; r < 4; ++r) weighted[r] = plane.value[c][r] * plane.weight[c][r];
    p[c] = dotRows(weighted, s);
    q[c] = dotRows(weighted, t);
  }
  const Float4 sumP = sums(p[0], p[1], p[2], p[3]);
  const Float4 sumQ = sums(q[0], q[1], q[2], q[3]);
  Float4 a, b, c;
  if (plane.uniform) {
    const Float4* w = plane.weight[0];
    const Float4 abc = sums(dotRows(ss, w), dotRows(st, w), dotRows(tt, w), splat(0));
    a = splat(abc[0]);
    b = splat(abc[1]);
    c = splat(abc[2]);
  } else {
    const auto& w = plane.weight;
    a = sums(dotRows(ss, w[0]), dotRows(ss, w[1]), dotRows(ss, w[2]), dotRows(ss, w[3]));
    b = sums(dotRows(st, w[0]), dotRows(st, w[1]), dotRows(st, w[2]), dotRows(st, w[3]));
    c = sums(dotRows(tt, w[0]), dotRows(tt, w[1]), dotRows(tt, w[2]), dotRows(tt, w[3]));
  }
  const Float4 determinant = a * c - b * b;
  const Int4 solvable = determinant > splat(1e-3f);
  const Float4 inverse = splat(1.0f) / select(solvable, determinant, splat(1.0f));
  const Line solved = {(sumP * c - sumQ * b) * inverse, (sumQ * a - sumP * b) * inverse};
  return clampLine({select(solvable, solved.first, fallback.first), select(solvable, solved.second, fallback.second)});
}

Float4 lineErrors(const Plane& plane, const Line& line, const Steps& steps, float levels) {
  Float4 error[4] = {splat(0), splat(0), splat(0), splat(0)};
  const Float4 span = line.second - line.first;
  for (int r = 0; r < 4; ++r) {
    const Float4 weight = round(steps.step[r] * splat(64.0f / levels));
    for (int c = 0; c < 4; ++c) {
      // Exact in floats: integers below 2^24 and a division by a power of two.
      const Float4 blend = splat(line.first[c]) * splat(64.0f) + weight * splat(span[c]);
      const Float4 decoded = truncate((blend + splat(32.0f)) * splat(1.0f / 64.0f));
      const Float4 difference = decoded - plane.value[c][r];
      error[c] += difference * difference * plane.weight[c][r];
    }
  }
  return sums(error[0], error[1], error[2], error[3]);
}

}  // namespace billow::compiler
