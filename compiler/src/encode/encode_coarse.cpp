// Bricks of 4x4x4 values, linear between them.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "encode/brick_lanes.h"

namespace billow::compiler {
namespace {

constexpr std::uint32_t kCoarse = 64;

// Voxel x along an axis is sum over X of kUp[x][X] c[X] (spec/format.md, coarse).
constexpr std::array<std::array<double, 4>, 8> upMatrix() {
  std::array<std::array<double, 4>, 8> up{};
  for (std::size_t x = 0; x < 8; ++x) {
    const std::size_t after = (x + 1) / 2;
    const double near = x % 2 != 0 ? 0.25 : 0.75;
    up[x][after == 0 ? 0 : after - 1] += 1 - near;
    up[x][std::min<std::size_t>(after, 3)] += near;
  }
  return up;
}
constexpr auto kUp = upMatrix();

// Its pseudo-inverse (U^T U)^-1 U^T: the four values whose voxels come nearest to given ones. As the brick's map is the
// product of those along the axes, so is its pseudo-inverse.
constexpr std::array<std::array<double, 8>, 4> downMatrix() {
  double rows[4][12] = {};  // U^T U beside U^T, eliminated by Gauss and Jordan
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t x = 0; x < 8; ++x) {
      for (std::size_t j = 0; j < 4; ++j) rows[i][j] += kUp[x][i] * kUp[x][j];
      rows[i][4 + x] = kUp[x][i];
    }
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const double pivot = rows[i][i];
    for (double& value : rows[i]) value /= pivot;
    for (std::size_t other = 0; other < 4; ++other) {
      if (other == i) continue;
      const double factor = rows[other][i];
      for (std::size_t j = 0; j < 12; ++j) rows[other][j] -= factor * rows[i][j];
    }
  }
  std::array<std::array<double, 8>, 4> down{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t x = 0; x < 8; ++x) down[i][x] = rows[i][4 + x];
  }
  return down;
}
constexpr auto kDown = downMatrix();

using Voxels = std::array<float, format::kBrickVoxels>;
using Points = std::array<float, kCoarse>;

// Contracts or expands one axis: `to` has To items where `from` has From, each `inner` numbers apart, `outer` times.
template <std::size_t To, std::size_t From, std::size_t Outer, std::size_t Inner>
void alongAxis(const std::array<std::array<double, From>, To>& matrix, const float* from, float* to) {
  for (std::size_t o = 0; o < Outer; ++o) {
    for (std::size_t t = 0; t < To; ++t) {
      float* out = to + (o * To + t) * Inner;
      for (std::size_t i = 0; i < Inner; ++i) out[i] = 0;
      for (std::size_t f = 0; f < From; ++f) {
        const auto factor = static_cast<float>(matrix[t][f]);
        const float* in = from + (o * From + f) * Inner;
        for (std::size_t i = 0; i < Inner; ++i) out[i] += factor * in[i];
      }
    }
  }
}

void contract(const Voxels& voxels, Points& points) {
  alignas(32) float x[4 * 64], y[4 * 4 * 8];
  alongAxis<4, 8, 1, 64>(kDown, voxels.data(), x);
  alongAxis<4, 8, 4, 8>(kDown, x, y);
  alongAxis<4, 8, 16, 1>(kDown, y, points.data());
}

void expand(const Points& points, Voxels& voxels) {
  alignas(32) float x[8 * 16], y[8 * 8 * 4];
  alongAxis<8, 4, 1, 16>(kUp, points.data(), x);
  alongAxis<8, 4, 8, 4>(kUp, x, y);
  alongAxis<8, 4, 64, 1>(kUp, y, voxels.data());
}

// Least squares over active voxels: inactive ones take what they would become, a few times over.
void fitPoints(const BrickSource& brick, const TexelTargets& targets, Points& points) {
  constexpr int kRounds = 4;
  if (brick.activeCount == format::kBrickVoxels) return contract(targets, points);
  TexelWeights weights;
  texelWeights(brick, weights);
  float sum = 0;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) sum += weights[i] * targets[i];
  const float mean = brick.activeCount == 0 ? 0 : sum / static_cast<float>(brick.activeCount);
  alignas(32) Voxels filled, expanded;
  expanded.fill(mean);
  for (int round = 0; round < kRounds; ++round) {
    for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
      filled[i] = weights[i] != 0 ? targets[i] : expanded[i];
    }
    contract(filled, points);
    if (round + 1 < kRounds) expand(points, expanded);
  }
}

}  // namespace

double estimateCoarse(const BrickSource& brick) {
  TexelWeights weights;
  texelWeights(brick, weights);
  double squares = 0, count = 0;
  for (std::uint32_t row = 0; row < format::kBrickVoxels; row += 8) {
    const float* v = brick.values->data() + row;
    const float* w = weights.data() + row;
    for (std::uint32_t z = 1; z < 7; ++z) {
      const double counts = static_cast<double>(w[z - 1] * w[z] * w[z + 1]);
      const double bend = static_cast<double>(v[z - 1]) - 2 * static_cast<double>(v[z]) + static_cast<double>(v[z + 1]);
      squares += counts * bend * bend;
      count += counts;
    }
  }
  // White noise of variance s^2 bends by 6 s^2 in the square; a point for eight voxels takes an eighth of it away.
  return count > 0 ? squares / count / 6 * 7 / 8 * brick.activeCount : 0;
}

void encodeCoarse(const BrickSource& brick, Candidate& out) {
  const ValueRange values = activeRange(brick);
  const TexelRange texels255 = coverRange(values, 0, 255);
  TexelTargets targets;
  texelTargets(brick, texels255, 0, 255, targets);
  Points points;
  fitPoints(brick, targets, points);
  // The points may lie beyond the values.
  const auto [least, greatest] = std::minmax_element(points.begin(), points.end());
  const auto unit = static_cast<double>(texels255.scale);
  const double lo = static_cast<double>(texels255.lo) + static_cast<double>(*least) * unit;
  const double width = (static_cast<double>(*greatest) - static_cast<double>(*least)) * unit;
  constexpr double kLargest = std::numeric_limits<float>::max();
  TexelRange range = {values.min, 0};
  if (width / (64 * 255) >= static_cast<double>(std::numeric_limits<float>::min()) && lo >= -kLargest &&
      lo + width <= kLargest / 2) {
    // A tenth of a step of the points is not seen.
    range = shorten(lo, width / (64 * 255), 64 * 255, width / 2550);
  }
  const double inverse = range.scale > 0 ? 1 / (64 * static_cast<double>(range.scale)) : 0;
  for (std::uint32_t i = 0; i < kCoarse; ++i) {
    const double value = static_cast<double>(texels255.lo) + static_cast<double>(points[i]) * unit;
    const double byte = std::clamp((value - static_cast<double>(range.lo)) * inverse, 0.0, 255.0);
    out.payload[i] = static_cast<std::byte>(static_cast<std::int32_t>(byte + 0.5));
  }
  out.encoding = format::kEncodingCoarse;
  out.texelMask = false;
  out.lo = range.lo;
  out.scale = range.scale;
  format::Texels texels;
  format::decodeTexels(format::kEncodingCoarse, {out.payload.data(), kCoarse}, texels);
  measure(brick, texels, out);
}

}  // namespace billow::compiler
