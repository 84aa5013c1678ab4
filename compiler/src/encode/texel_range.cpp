#include "encode/texel_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace billow::compiler {
namespace {

constexpr std::uint32_t kLanes = 8;  // independent sums, so that additions overlap; their order is fixed

}  // namespace

ValueRange activeRange(const BrickSource& brick) {
  if (brick.activeCount == 0) return {};
  float lows[kLanes], highs[kLanes];
  std::fill_n(lows, kLanes, std::numeric_limits<float>::max());
  std::fill_n(highs, kLanes, std::numeric_limits<float>::lowest());
  TexelWeights weights;
  texelWeights(brick, weights);
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
    for (std::uint32_t j = 0; j < kLanes; ++j) {
      const float value = (*brick.values)[i + j];
      const bool active = weights[i + j] != 0.0f;
      const float low = active ? value : std::numeric_limits<float>::max();
      const float high = active ? value : std::numeric_limits<float>::lowest();
      lows[j] = low < lows[j] ? low : lows[j];
      highs[j] = high > highs[j] ? high : highs[j];
    }
  }
  return {*std::min_element(lows, lows + kLanes), *std::max_element(highs, highs + kLanes)};
}

TexelRange coverRange(ValueRange range, std::uint32_t first, std::uint32_t last) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  const double steps = last - first;
  const double width = static_cast<double>(range.max) - static_cast<double>(range.min);
  if (!(width > 0)) return {range.min, 0};
  const double step = std::min(width / steps, kLargest / last);
  float scale = static_cast<float>(step);
  // Near the denormals one unit of `scale` is a large part of it: take the next above, or the top would be cut.
  if (static_cast<double>(scale) * steps < width) scale = std::nextafter(scale, std::numeric_limits<float>::max());
  const double wanted = static_cast<double>(range.min) - static_cast<double>(scale) * first;
  const float lo = wanted < -kLargest ? -std::numeric_limits<float>::infinity() : static_cast<float>(wanted);
  while (std::isfinite(lo) && !std::isfinite(format::reconstruct(lo, scale, last))) scale = std::nextafter(scale, 0.0f);
  return {lo, scale};
}

void texelTargets(const BrickSource& brick, TexelRange range, std::uint32_t first, std::uint32_t last,
                  TexelTargets& targets) {
  // In double: 1 / scale of a denormal is finite there, and so is the difference of any two floats.
  const double inverse = range.scale > 0 ? 1.0 / static_cast<double>(range.scale) : 0.0;
  const auto lo = static_cast<double>(range.lo);
  const auto low = static_cast<double>(first);
  const auto high = static_cast<double>(last);
  TexelWeights weights;
  texelWeights(brick, weights);
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const double raw = (static_cast<double>((*brick.values)[i]) - lo) * inverse;
    const double above = raw > low ? raw : low;
    const double inside = above < high ? above : high;
    targets[i] = weights[i] != 0.0f ? static_cast<float>(inside) : static_cast<float>(low);
  }
}

void texelWeights(const BrickSource& brick, TexelWeights& weights) {
  for (std::uint32_t word = 0; word < 16; ++word) {
    const std::uint32_t bits = brick.active->words[word];
    for (std::uint32_t i = 0; i < 32; ++i) weights[word * 32 + i] = static_cast<float>(bits >> i & 1u);
  }
}

void measure(const BrickSource& brick, const format::Texels& texels, Candidate& candidate) {
  double squared[kLanes] = {};
  double largest[kLanes] = {};
  TexelWeights weights;
  texelWeights(brick, weights);
  const float lo = candidate.lo;
  const float scale = candidate.scale;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
    for (std::uint32_t j = 0; j < kLanes; ++j) {
      // format::reconstruct, repeated here so that it can be vectorised; the tests hold the two together.
      const float product = scale * static_cast<float>(static_cast<std::int32_t>(texels[i + j]));
      const float value = lo + product;
      const double difference = static_cast<double>(value) - static_cast<double>((*brick.values)[i + j]);
      const double error = weights[i + j] != 0.0f ? std::abs(difference) : 0.0;
      squared[j] += error * error;
      largest[j] = error > largest[j] ? error : largest[j];
    }
  }
  candidate.squaredError = 0;
  for (const double lane : squared) candidate.squaredError += lane;
  constexpr double kLargest = std::numeric_limits<float>::max();
  candidate.maxError = static_cast<float>(std::min(kLargest, *std::max_element(largest, largest + kLanes)));
}

}  // namespace billow::compiler
