#include "encode/encode_for_disk.h"

#include <cmath>

#include "encode/index_bits.h"
#include "encode/uniform_fit.h"
#include "encode/uniform_lanes.h"

namespace billow::compiler {
namespace {

// Of a squared step, that a bit on disk is worth where steps suit the exchange of error for bits: the error of a
// uniform quantiser, a twelfth of it, falls by 2 ln 2 of itself a bit.
constexpr double kStepsSquaredPerBit = 0.1155;

// Moves indices towards what their neighbours foretell where the bits that saves are worth the error. `bitWorth` in
// squared steps, `farthest` in steps. Returns the indices' length, in 1/256 bit.
std::uint32_t favourForetold(const BrickSource& brick, const ActiveValues& active, IndexRange range, const Fit& fit,
                             double bitWorth, double farthest, float* indices) {
  const double inverse = fit.scale > 0 ? 1 / static_cast<double>(fit.scale) : 0;
  std::uint32_t i = 0, length = 0;
  IndexWalk::run(*brick.active, range, [&](const IndexGuess& guess) {
    const double place = (static_cast<double>(active.value[i]) - static_cast<double>(fit.lo)) * inverse;
    auto index = static_cast<std::int32_t>(indices[i]);
    std::uint32_t bits = indexBits256(guess, range, index);
    const std::int32_t away = guess.eighths - 8 * index;
    if (away > 4 || away < -4) {
      const std::int32_t other = index + (away > 0 ? 1 : -1);
      const std::uint32_t otherBits = indexBits256(guess, range, other);
      const double off = place - index;
      const double otherOff = place - other;
      const double saved = bitWorth / 256 * (static_cast<double>(bits) - static_cast<double>(otherBits));
      if (otherOff * otherOff - off * off < saved && otherOff <= farthest && -otherOff <= farthest) {
        index = other;
        bits = otherBits;
      }
    }
    length += bits;
    indices[i++] = static_cast<float>(index);
    return index;
  });
  return length;
}

// The lo and scale that suit these indices best.
void refit(const ActiveValues& active, std::uint32_t last, const float* indices, Fit& fit) {
  double sumI = 0, sumII = 0, sumV = 0, sumIV = 0;
  const auto lo = static_cast<double>(fit.lo);
  for (std::uint32_t k = 0; k < active.count; ++k) {
    const auto i = static_cast<double>(indices[k]);
    const double v = static_cast<double>(active.value[k]) - lo;
    sumI += i;
    sumII += i * i;
    sumV += v;
    sumIV += i * v;
  }
  const double n = active.count;
  const double determinant = n * sumII - sumI * sumI;
  if (!(determinant > 0) || !(fit.squaredError > 0)) return;
  const double step = (n * sumIV - sumI * sumV) / determinant;
  if (!(step >= static_cast<double>(std::numeric_limits<float>::min()))) return;
  const double tolerance = std::sqrt(fit.squaredError / n / kRoundingShare);
  const TexelRange range = shorten((sumV - step * sumI) / n + lo, step, last, tolerance);
  if (!isStorable(range, last)) return;
  Fit fitted = fit;
  fitted.lo = range.lo;
  fitted.scale = range.scale;
  measureIndices(active, indices, fitted);
  if (fitted.squaredError < fit.squaredError) fit = fitted;
}

}  // namespace

std::uint32_t encodeUniformForDisk(const BrickSource& brick, const DiskUniform& wanted, Candidate& out) {
  const ActiveValues active(brick);
  alignas(32) float indices[format::kBrickVoxels];
  const std::uint32_t first = fitUniform(brick, active, wanted.last, indices, out);
  const IndexRange range{static_cast<std::int32_t>(first), static_cast<std::int32_t>(wanted.last)};
  const auto step = static_cast<double>(out.scale);
  const double bitWorth = wanted.bitWorth > 0 ? wanted.bitWorth / (step * step) : kStepsSquaredPerBit;
  const double farthest = static_cast<double>(wanted.limit) / step;
  const std::uint32_t length = favourForetold(brick, active, range, out, bitWorth, farthest, indices);
  measureIndices(active, indices, out);
  refit(active, wanted.last, indices, out);
  format::Texels texels;
  spread(brick, indices, texels);
  format::packIndices(texels, format::indexBits(out.encoding), out.payload.data());
  return length;
}

}  // namespace billow::compiler
