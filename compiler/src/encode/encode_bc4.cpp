// BC4 bricks: 32 blocks of 16 scalars, each with two 8-bit endpoints and 3-bit steps between them.
#include <utility>

#include "encode/scalar_fit.h"
#include "encode/stored_order.h"
#include "encode/texel_range.h"

namespace billow::compiler {
namespace {

// A block as it will be stored: with eight steps where first > second, else with six and the constants 0 and 255.
struct Bc4Fit {
  std::uint32_t first = 0, second = 0;
  Float4 step[4];  // eight: [0, 7] from first to second. Six: [0, 5], or 6 for 0 and 7 for 255
  float error = 0;
};

std::uint32_t toByte(float value) {
  const float above = value > 0.0f ? value : 0.0f;
  const float shifted = (above < 255.0f ? above : 255.0f) + 0.5f;
  return static_cast<std::uint32_t>(shifted);
}

// What is decoded `step` of `levels` (7 or 5) from first to second: rounded to the nearest integer.
Float4 paletteValue(float first, float second, Float4 step, float levels) {
  const Float4 blend = splat(first) * (splat(levels) - step) + splat(second) * step;
  return round(blend * splat(1.0f / levels));
}

void tryEightSteps(const Scalars& scalars, Segment segment, Bc4Fit& best) {
  Bc4Fit fit;
  fit.first = toByte(segment.second);
  fit.second = toByte(segment.first);
  if (fit.first < fit.second) std::swap(fit.first, fit.second);
  if (fit.first == fit.second) {  // equal endpoints would mean six steps
    if (fit.first < 255) {
      ++fit.first;
    } else {
      --fit.second;
    }
  }
  const auto first = static_cast<float>(fit.first);
  const auto second = static_cast<float>(fit.second);
  scalarSteps(scalars, {first, second}, 7.0f, fit.step);
  Float4 error = splat(0);
  for (int r = 0; r < 4; ++r) {
    const Float4 difference = paletteValue(first, second, fit.step[r], 7.0f) - scalars.value[r];
    error += difference * difference * scalars.weight[r];
  }
  fit.error = sum(error);
  if (fit.error < best.error) best = fit;
}

void trySixSteps(const Scalars& scalars, Segment segment, Bc4Fit& best) {
  Bc4Fit fit;
  fit.first = toByte(segment.first);
  fit.second = toByte(segment.second);
  if (fit.first > fit.second) fit.second = fit.first;
  const auto first = static_cast<float>(fit.first);
  const auto second = static_cast<float>(fit.second);
  scalarSteps(scalars, {first, second}, 5.0f, fit.step);
  Float4 error = splat(0);
  for (int r = 0; r < 4; ++r) {
    const Float4 value = scalars.value[r];
    const Float4 onSegment = paletteValue(first, second, fit.step[r], 5.0f) - value;
    const Float4 fromTop = splat(255.0f) - value;
    const Float4 squared = onSegment * onSegment;
    const Float4 bottomSquared = value * value;
    const Float4 topSquared = fromTop * fromTop;
    fit.step[r] = select(bottomSquared < min(squared, topSquared), splat(6.0f), fit.step[r]);
    fit.step[r] = select(topSquared < min(squared, bottomSquared), splat(7.0f), fit.step[r]);
    error += min(squared, min(bottomSquared, topSquared)) * scalars.weight[r];
  }
  fit.error = sum(error);
  if (fit.error < best.error) best = fit;
}

// The scalars that neither constant of the six-step mode serves.
Scalars betweenConstants(const Scalars& scalars) {
  Scalars inner = scalars;
  for (int r = 0; r < 4; ++r) {
    const Float4 value = scalars.value[r];
    const Int4 inside = (value > splat(1.0f)) & (value < splat(254.0f));
    inner.weight[r] = select(inside, scalars.weight[r], splat(0));
  }
  return inner;
}

// Least squares from several starts, since it only finds the optimum nearest to each: the whole range, and ranges that
// leave out the outermost values.
void refineEightSteps(const Scalars& scalars, Segment range, Bc4Fit& best) {
  static constexpr float kInsets[] = {0.0f, 0.06f, 0.12f};
  const float width = range.second - range.first;
  for (const float inset : kInsets) {
    Segment segment = {range.first + inset * width, range.second - inset * width};
    for (int pass = 0; pass < 2; ++pass) {
      Float4 position[4];
      scalarSteps(scalars, segment, 7.0f, position);
      for (Float4& p : position) p *= splat(1.0f / 7.0f);
      segment = scalarLeastSquares(scalars, position, segment);
      tryEightSteps(scalars, segment, best);
    }
  }
}

// Moves one end at a time by a texel or two.
void nudgeEightSteps(const Scalars& scalars, Bc4Fit& best) {
  static constexpr float kMoves[] = {-2.0f, -1.0f, 1.0f, 2.0f};
  if (best.first <= best.second) return;
  for (const float move : kMoves) {
    const auto low = static_cast<float>(best.second);
    tryEightSteps(scalars, {low + move, static_cast<float>(best.first)}, best);
    const auto high = static_cast<float>(best.first);
    tryEightSteps(scalars, {static_cast<float>(best.second), high + move}, best);
  }
}

Bc4Fit fitBlock(const Scalars& scalars) {
  Bc4Fit best;
  best.error = 1e30f;
  const Segment range = scalarRange(scalars);
  trySixSteps(scalars, range, best);
  if (best.error <= 0.0f) return best;
  tryEightSteps(scalars, range, best);
  if (range.first < 1.0f || range.second > 254.0f) {
    trySixSteps(scalars, scalarRange(betweenConstants(scalars)), best);
  }
  refineEightSteps(scalars, range, best);
  nudgeEightSteps(scalars, best);
  return best;
}

void storeBlock(const Bc4Fit& fit, std::byte* block) {
  // Palette number of a step: the endpoints come first.
  static constexpr std::uint8_t kEight[8] = {0, 2, 3, 4, 5, 6, 7, 1};
  static constexpr std::uint8_t kSix[8] = {0, 2, 3, 4, 5, 1, 6, 7};
  const std::uint8_t* number = fit.first > fit.second ? kEight : kSix;
  std::uint64_t bits = fit.first | fit.second << 8;
  for (std::uint32_t i = 0; i < 16; ++i) {
    const auto step = static_cast<std::uint32_t>(fit.step[i >> 2][i & 3]);
    bits |= std::uint64_t{number[step]} << (16 + 3 * i);
  }
  for (std::uint32_t i = 0; i < 8; ++i) block[i] = static_cast<std::byte>(bits >> (8 * i) & 0xff);
}

// Sum over the blocks along an axis of the square of their range, which BC4's error follows.
float blockRanges(const StoredBrick& stored) {
  float total = 0;
  for (std::uint32_t block = 0; block < 32; ++block) {
    const Segment range = scalarRange(stored.scalars(block));
    total += (range.second - range.first) * (range.second - range.first);
  }
  return total;
}

void encodeStored(const BrickSource& brick, std::uint32_t encoding, const StoredBrick& stored, TexelRange range,
                  Candidate& out) {
  out.encoding = encoding;
  out.texelMask = false;
  out.lo = range.lo;
  out.scale = range.scale;
  for (std::uint32_t block = 0; block < 32; ++block) {
    storeBlock(fitBlock(stored.scalars(block)), &out.payload[8 * block]);
  }
  format::Texels texels;
  format::decodeTexels(encoding, {out.payload.data(), 256}, texels);
  measure(brick, texels, out);
}

}  // namespace

void encodeBc4(const BrickSource& brick, std::uint32_t encoding, Candidate& out) {
  const BrickTargets targets(brick);
  encodeStored(brick, encoding, StoredBrick(targets, format::packedAxis(encoding)), targets.range, out);
}

void encodeBc4BestAxis(const BrickSource& brick, Candidate& out) {
  const BrickTargets targets(brick);
  const StoredBrick stored[3] = {StoredBrick(targets, 2), StoredBrick(targets, 1), StoredBrick(targets, 0)};
  std::uint32_t best = 0;
  float least = blockRanges(stored[0]);
  for (std::uint32_t i = 1; i < 3; ++i) {
    const float ranges = blockRanges(stored[i]);
    if (ranges < least) {
      least = ranges;
      best = i;
    }
  }
  encodeStored(brick, format::kEncodingBc4Z + best, stored[best], targets.range, out);
}

}  // namespace billow::compiler
