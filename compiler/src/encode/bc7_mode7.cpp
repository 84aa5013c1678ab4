// Mode 7: two lines, each for one half of a partition of the texels, four steps, ends of five bits and a p-bit.
#include <array>

#include "billow/format/bc7_tables.h"
#include "encode/bc7_lines.h"

namespace billow::compiler {
namespace {

constexpr float kLevels = 3.0f;
constexpr std::uint32_t kPartitions = 64;

// Sums over a set of texels, from which the residual about the best line follows.
struct Moments {
  Float4 product[4] = {splat(0), splat(0), splat(0), splat(0)};  // of deviations, channel by channel
  Float4 total = splat(0);
  Float4 count = splat(0);

  void add(const Moments& other) {
    for (int c = 0; c < 4; ++c) product[c] += other.product[c];
    total += other.total;
    count += other.count;
  }
  Moments without(const Moments& other) const {
    Moments rest;
    for (int c = 0; c < 4; ++c) rest.product[c] = product[c] - other.product[c];
    rest.total = total - other.total;
    rest.count = count - other.count;
    return rest;
  }
};

std::array<Moments, 16> texelMoments(const Plane& plane) {
  std::array<Moments, 16> moments;
  for (std::uint32_t i = 0; i < 16; ++i) {
    Float4 deviation, count;
    for (std::uint32_t c = 0; c < 4; ++c) {
      count[c] = plane.weight[c][i >> 2][i & 3];
      deviation[c] = (plane.value[c][i >> 2][i & 3] - 127.5f) * count[c];
    }
    for (std::uint32_t c = 0; c < 4; ++c) moments[i].product[c] = deviation * splat(deviation[c]);
    moments[i].total = deviation;
    moments[i].count = count;
  }
  return moments;
}

// About what remains of the squared deviations once the best line is taken out: trace less the largest eigenvalue, by
// one step of power iteration. Good for ranking only.
float residual(const Moments& moments) {
  const Float4 mean = moments.total / max(moments.count, splat(1.0f));
  Float4 row[4];
  for (int c = 0; c < 4; ++c) row[c] = moments.product[c] - moments.total * splat(mean[c]);
  int start = 0;
  for (int c = 1; c < 4; ++c) {
    if (row[c][c] > row[start][start]) start = c;
  }
  const float trace = (row[0][0] + row[1][1]) + (row[2][2] + row[3][3]);
  const Float4 axis = row[start];
  const float squares = sum(axis * axis);
  if (!(squares > 1e-6f)) return trace;
  const Float4 image =
      (row[0] * splat(axis[0]) + row[1] * splat(axis[1])) + (row[2] * splat(axis[2]) + row[3] * splat(axis[3]));
  return trace - sum(image * axis) / squares;
}

std::array<float, kPartitions> rankPartitions(const Plane& plane) {
  const std::array<Moments, 16> texels = texelMoments(plane);
  Moments all;
  for (const Moments& texel : texels) all.add(texel);
  std::array<float, kPartitions> residuals;
  for (std::uint32_t p = 0; p < kPartitions; ++p) {
    Moments second;
    for (std::uint32_t i = 0; i < 16; ++i) {
      if ((format::kBc7Partitions2[p] >> i & 1u) != 0) second.add(texels[i]);
    }
    residuals[p] = residual(second) + residual(all.without(second));
  }
  return residuals;
}

Plane subsetPlane(const Plane& plane, std::uint32_t texels) {
  Plane subset = plane;
  for (std::uint32_t r = 0; r < 4; ++r) {
    Float4 mask;
    for (std::uint32_t i = 0; i < 4; ++i) mask[i] = static_cast<float>(texels >> (4 * r + i) & 1u);
    for (std::uint32_t c = 0; c < 4; ++c) subset.weight[c][r] = plane.weight[c][r] * mask;
  }
  return subset;
}

void tryPartition(const Plane& plane, std::uint32_t partition, const Bc7Search& search, Bc7Fit& best) {
  const std::uint32_t texels = format::kBc7Partitions2[partition];
  const LineFit first = fitLineWithP<6>(subsetPlane(plane, ~texels & 0xffffu), kLevels, search);
  if (!(first.error < best.error)) return;
  const LineFit second = fitLineWithP<6>(subsetPlane(plane, texels), kLevels, search);
  const float error = first.error + second.error;
  if (!(error < best.error)) return;
  best.mode = 7;
  best.partition = partition;
  best.rotation = 0;
  best.colorIsSecond = false;
  best.line[0] = first.line;
  best.line[1] = second.line;
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Steps& from = (texels >> i & 1u) != 0 ? second.steps : first.steps;
    best.steps.step[i >> 2][i & 3] = from.step[i >> 2][i & 3];
  }
  best.error = error;
}

}  // namespace

void tryMode7(const Plane& plane, const Bc7Search& search, Bc7Fit& best) {
  std::array<float, kPartitions> residuals = rankPartitions(plane);
  for (int n = 0; n < search.partitions; ++n) {
    std::uint32_t next = 0;
    for (std::uint32_t p = 1; p < kPartitions; ++p) {
      if (residuals[p] < residuals[next]) next = p;
    }
    // The steps between cannot gain back what the lines leave.
    if (!(residuals[next] < best.error)) return;
    tryPartition(plane, next, search, best);
    residuals[next] = 1e30f;
  }
}

}  // namespace billow::compiler
