#include "encode/brick_lanes.h"

#include <cstring>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encode/brick_lanes.cpp"
#include <hwy/foreach_target.h>

#include "encode/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {
namespace {

void setTexelWeights(const BrickSource& brick, TexelWeights& weights) {
  static constexpr std::uint32_t kBits[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  float* to = weights.data();
  for (std::uint32_t byte = 0; byte < format::kBrickVoxels / 8; ++byte) {
    const std::uint32_t bits = brick.active->words[byte >> 2] >> (8 * (byte & 3));
    for (std::uint32_t i = 0; i < 8; ++i) to[byte * 8 + i] = (bits & kBits[i]) != 0 ? 1.0f : 0.0f;
  }
}

ValueRange activeRange(const BrickSource& brick) {
  if (brick.activeCount == 0) return {};
  TexelWeights weights;
  setTexelWeights(brick, weights);
  const float* values = brick.values->data();
  V low = all(std::numeric_limits<float>::max());
  V high = all(std::numeric_limits<float>::lowest());
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
    const V value = load(values + i);
    const M active = load(weights.data() + i) > all(0.0f);
    low = select(both(active, value < low), value, low);
    high = select(both(active, value > high), value, high);
  }
  float lows[kLanes], highs[kLanes];
  store(low, lows);
  store(high, highs);
  ValueRange range = {lows[0], highs[0]};
  for (std::uint32_t lane = 1; lane < kLanes; ++lane) {
    range.min = lows[lane] < range.min ? lows[lane] : range.min;
    range.max = highs[lane] > range.max ? highs[lane] : range.max;
  }
  // Zeros of either sign are equal, and which one comes first depends on the number of lanes.
  return {range.min + 0.0f, range.max + 0.0f};
}

void texelTargets(const BrickSource& brick, TexelRange range, std::uint32_t first, std::uint32_t last,
                  TexelTargets& targets) {
  // In double: 1 / scale of a denormal is finite there, and so is the difference of any two floats.
  const double inverse = range.scale > 0 ? 1.0 / static_cast<double>(range.scale) : 0.0;
  const auto lo = static_cast<double>(range.lo);
  const auto low = static_cast<double>(first);
  const auto high = static_cast<double>(last);
  const float* values = brick.values->data();
  float* to = targets.data();
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const double raw = (static_cast<double>(values[i]) - lo) * inverse;
    const double above = raw > low ? raw : low;
    to[i] = static_cast<float>(above < high ? above : high);
  }
  if (brick.activeCount == format::kBrickVoxels) return;
  TexelWeights weights;
  setTexelWeights(brick, weights);
  const V inactive = all(static_cast<float>(first));
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
    store(select(load(weights.data() + i) > all(0.0f), load(to + i), inactive), to + i);
  }
}

void measure(const BrickSource& brick, const format::Texels& texels, Candidate& candidate) {
  // format::reconstruct, repeated here so that it can be vectorised; the tests hold the two together.
  alignas(32) float decoded[format::kBrickVoxels];
  const std::uint16_t* texel = texels.data();
  const float lo = candidate.lo;
  const float scale = candidate.scale;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const float product = scale * static_cast<float>(static_cast<std::int32_t>(texel[i]));
    decoded[i] = lo + product;
  }
  const float* values = brick.values->data();
  if (brick.activeCount != format::kBrickVoxels) {
    TexelWeights weights;
    setTexelWeights(brick, weights);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
      store(select(load(weights.data() + i) > all(0.0f), load(decoded + i), load(values + i)), decoded + i);
    }
  }
  // In double: the difference of any two floats is finite there. Eight sums whatever the vectors' width, so that every
  // machine adds in the same order.
  constexpr std::uint32_t kSums = 8;
  double squared[kSums] = {};
  double largest[kSums] = {};
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kSums) {
    for (std::uint32_t j = 0; j < kSums; ++j) {
      const double error = static_cast<double>(decoded[i + j]) - static_cast<double>(values[i + j]);
      const double magnitude = error < 0 ? -error : error;
      squared[j] += error * error;
      largest[j] = largest[j] > magnitude ? largest[j] : magnitude;
    }
  }
  candidate.squaredError = 0;
  double most = 0;
  for (std::uint32_t j = 0; j < kSums; ++j) {
    candidate.squaredError += squared[j];
    most = largest[j] > most ? largest[j] : most;
  }
  constexpr double kLargest = std::numeric_limits<float>::max();
  candidate.maxError = static_cast<float>(most < kLargest ? most : kLargest);
}

void copyBlocks(const float* from, std::uint32_t packedAxis, float (*to)[16][8]) {
  // Strides in voxelIndex of the stored x, y and z.
  const std::uint32_t strideX = packedAxis == 0 ? 1 : 64;
  const std::uint32_t strideY = packedAxis == 1 ? 1 : 8;
  const std::uint32_t strideZ = packedAxis == 0 ? 64 : packedAxis == 1 ? 8 : 1;
  for (std::uint32_t block = 0; block < 8; ++block) {
    const std::uint32_t corner = 4 * ((block & 1) * strideX + (block >> 1 & 1) * strideY + (block >> 2) * strideZ);
    for (std::uint32_t c = 0; c < 4; ++c) {
      for (std::uint32_t i = 0; i < 16; ++i) {
        to[c][i][block] = from[corner + c * strideZ + (i & 3) * strideX + (i >> 2) * strideY];
      }
    }
  }
}

void arrange(const BrickTargets& targets, std::uint32_t packedAxis, BlockTexels& texels) {
  texels.allActive = targets.allActive;
  copyBlocks(targets.value.data(), packedAxis, texels.value);
  if (!texels.allActive) copyBlocks(targets.weight.data(), packedAxis, texels.weight);
}

}  // namespace
}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace billow::compiler {

HWY_EXPORT(activeRange);
HWY_EXPORT(texelTargets);
HWY_EXPORT(setTexelWeights);
HWY_EXPORT(measure);
HWY_EXPORT(arrange);

ValueRange activeRange(const BrickSource& brick) {
  return HWY_DYNAMIC_DISPATCH(activeRange)(brick);
}

void texelTargets(const BrickSource& brick, TexelRange range, std::uint32_t first, std::uint32_t last,
                  TexelTargets& targets) {
  HWY_DYNAMIC_DISPATCH(texelTargets)(brick, range, first, last, targets);
}

void texelWeights(const BrickSource& brick, TexelWeights& weights) {
  HWY_DYNAMIC_DISPATCH(setTexelWeights)(brick, weights);
}

void measure(const BrickSource& brick, const format::Texels& texels, Candidate& candidate) {
  HWY_DYNAMIC_DISPATCH(measure)(brick, texels, candidate);
}

void arrange(const BrickTargets& targets, std::uint32_t packedAxis, BlockTexels& texels) {
  HWY_DYNAMIC_DISPATCH(arrange)(targets, packedAxis, texels);
}

BrickTargets::BrickTargets(const BrickSource& brick) : BrickTargets(brick, coverRange(activeRange(brick), 0, 255)) {}

BrickTargets::BrickTargets(const BrickSource& brick, TexelRange texelRange)
    : range(texelRange), allActive(brick.activeCount == format::kBrickVoxels) {
  texelTargets(brick, range, 0, 255, value);
  if (!allActive) texelWeights(brick, weight);
}

}  // namespace billow::compiler
#endif  // HWY_ONCE
