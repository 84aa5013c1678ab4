// Bricks that store an index a voxel, all on one scale: of 1 to 8 bits, or of 16.
#include <bit>
#include <cmath>
#include <limits>

#include "encode/brick_lanes.h"
#include "encode/uniform_fit.h"
#include "encode/uniform_lanes.h"

namespace billow::compiler {
namespace {

constexpr int kRounds = 4;

// The levels 0 to `last` with the least squared error that alternating between nearest levels and least squares finds,
// from levels in the middle of equal parts on.
Levels fitLevels(const ActiveValues& active, std::uint32_t last, double& squaredError) {
  const auto top = static_cast<float>(last);
  const float part = 1 / (top + 1);
  Levels levels{0.5f * part, part, top};
  Levels best = levels;
  const double n = active.count;
  squaredError = std::numeric_limits<double>::max();
  for (int round = 0; round < kRounds; ++round) {
    const LevelSums sums = sumNearest(active, levels);
    if (sums.squaredError >= squaredError) break;
    squaredError = sums.squaredError;
    best = levels;
    const double determinant = n * sums.levelSquared - sums.level * sums.level;
    if (!(determinant > 0)) break;
    const double step = (n * sums.product - sums.level * sums.place) / determinant;
    if (!(step > 0)) break;
    levels.step = static_cast<float>(step);
    levels.first = static_cast<float>((sums.place - step * sums.level) / n);
  }
  return best;
}

// Where voxels are inactive, index 0 is theirs and active ones start at 1.
std::uint32_t firstIndex(const BrickSource& brick) {
  return brick.activeCount < format::kBrickVoxels ? 1 : 0;
}

// lo and scale for indices [first, last]: fitted where that is possible in single precision.
TexelRange fitRange(const ActiveValues& active, std::uint32_t first, std::uint32_t last) {
  if (active.count == 0) return {};
  const TexelRange covering = coverRange(active.range, first, last);
  if (last > 255 || !(covering.scale > 0)) return covering;
  double error = 0;
  const Levels levels = fitLevels(active, last - first, error);
  const auto low = static_cast<double>(active.range.min);
  const double width = static_cast<double>(active.range.max) - low;
  const double step = static_cast<double>(levels.step) * width;
  // Among denormals a step is no longer as fine as its least squares.
  if (step < static_cast<double>(std::numeric_limits<float>::min())) return covering;
  const double lo = low + static_cast<double>(levels.first) * width - step * first;
  const double tolerance = std::sqrt(error / active.count / kRoundingShare) * width;
  const TexelRange fitted = shorten(lo, step, last, tolerance);
  return isStorable(fitted, last) ? fitted : covering;
}

constexpr std::uint32_t lastOf(std::uint32_t bits) {
  return (1u << bits) - 1;
}

}  // namespace

bool isStorable(const TexelRange& range, std::uint32_t last) {
  return std::isfinite(range.lo) && std::isfinite(format::reconstruct(range.lo, range.scale, last));
}

std::uint32_t fitUniform(const BrickSource& brick, const ActiveValues& active, std::uint32_t last, float* indices,
                         Fit& fit) {
  std::uint32_t first = firstIndex(brick);
  TexelRange range = fitRange(active, first, last);
  if (!(range.lo >= std::numeric_limits<float>::lowest())) {
    first = 0;
    range = fitRange(active, first, last);
  }
  fit.encoding = format::uniformEncoding(static_cast<std::uint32_t>(std::bit_width(last)));
  fit.texelMask = first != 0;
  fit.lo = range.lo;
  fit.scale = range.scale;
  quantise(active, first, last, indices, fit);
  return first;
}

void fitUniforms(const BrickSource& brick, std::uint32_t first, std::uint32_t last, std::array<Fit, 8>& fits) {
  const ActiveValues active(brick);
  alignas(32) float indices[format::kBrickVoxels];
  for (std::uint32_t bits = first; bits <= last; ++bits)
    fitUniform(brick, active, lastOf(bits), indices, fits[bits - 1]);
}

std::array<double, 8> estimateUniforms(const BrickSource& brick) {
  const ValueRange range = activeRange(brick);
  const double width = static_cast<double>(range.max) - static_cast<double>(range.min);
  std::array<double, 8> errors;
  for (std::uint32_t bits = 1; bits <= 8; ++bits) {
    const double levels = (1u << bits) - firstIndex(brick);
    errors[bits - 1] = brick.activeCount * width * width / (12 * levels * levels);
  }
  return errors;
}

void encodeUniform(const BrickSource& brick, std::uint32_t bits, Candidate& out) {
  const ActiveValues active(brick);
  alignas(32) float indices[format::kBrickVoxels];
  fitUniform(brick, active, lastOf(bits), indices, out);
  format::Texels texels;
  spread(brick, indices, texels);
  format::packIndices(texels, bits, out.payload.data());
}

}  // namespace billow::compiler
