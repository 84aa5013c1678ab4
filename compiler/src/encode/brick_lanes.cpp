#include "encode/brick_lanes.h"

#include <limits>

#include "encode/error_sums.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encode/brick_lanes.cpp"
#include <hwy/foreach_target.h>

#include "encode/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {
namespace {

using IntLanes = hn::Rebind<std::uint32_t, FloatLanes>;

// Which of the voxels from `index` on are active.
HWY_INLINE M activeFrom(const BrickSource& brick, std::uint32_t index) {
  alignas(32) static constexpr std::uint32_t kBits[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  const auto bits = hn::Set(IntLanes(), brick.active->words[index >> 5] >> (index & 31));
  return hn::RebindMask(FloatLanes(), hn::TestBit(bits, hn::LoadU(IntLanes(), kBits)));
}

void setTexelWeights(const BrickSource& brick, TexelWeights& weights) {
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
    store(select(activeFrom(brick, i), all(1.0f), all(0.0f)), weights.data() + i);
  }
}

ValueRange activeRange(const BrickSource& brick) {
  if (brick.activeCount == 0) return {};
  const float* values = brick.values->data();
  V low = all(std::numeric_limits<float>::max());
  V high = all(std::numeric_limits<float>::lowest());
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
    const V value = load(values + i);
    const M active = activeFrom(brick, i);
    low = select(active, min(value, low), low);
    high = select(active, max(value, high), high);
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

using DoubleLanes = hn::CappedTag<double, 8>;
using HalfLanes = hn::Rebind<float, DoubleLanes>;  // as many floats
constexpr auto kDoubleLanes = static_cast<std::uint32_t>(hn::MaxLanes(DoubleLanes()));

HWY_INLINE hn::Vec<DoubleLanes> loadDoubles(const float* from) {
  return hn::PromoteTo(DoubleLanes(), hn::LoadU(HalfLanes(), from));
}

void texelTargets(const BrickSource& brick, TexelRange range, std::uint32_t first, std::uint32_t last,
                  TexelTargets& targets) {
  // In double: 1 / scale of a denormal is finite there, and so is the difference of any two floats.
  const auto inverse = hn::Set(DoubleLanes(), range.scale > 0 ? 1.0 / static_cast<double>(range.scale) : 0.0);
  const auto lo = hn::Set(DoubleLanes(), static_cast<double>(range.lo));
  const auto low = hn::Set(DoubleLanes(), static_cast<double>(first));
  const auto high = hn::Set(DoubleLanes(), static_cast<double>(last));
  const float* values = brick.values->data();
  float* to = targets.data();
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kDoubleLanes) {
    const auto raw = (loadDoubles(values + i) - lo) * inverse;
    hn::StoreU(hn::DemoteTo(HalfLanes(), hn::Min(hn::Max(raw, low), high)), HalfLanes(), to + i);
  }
  if (brick.activeCount == format::kBrickVoxels) return;
  const V inactive = all(static_cast<float>(first));
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
    store(select(activeFrom(brick, i), load(to + i), inactive), to + i);
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
    for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kLanes) {
      store(select(activeFrom(brick, i), load(decoded + i), load(values + i)), decoded + i);
    }
  }
  // In double: the difference of any two floats is finite there. Eight sums whatever the vectors' width, so that every
  // machine adds in the same order.
  constexpr std::uint32_t kSums = ErrorSums::kParts;
  constexpr std::uint32_t kParts = kSums / kDoubleLanes;
  hn::Vec<DoubleLanes> squaredParts[kParts], largestParts[kParts];
  for (std::uint32_t part = 0; part < kParts; ++part) {
    squaredParts[part] = largestParts[part] = hn::Zero(DoubleLanes());
  }
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kSums) {
    for (std::uint32_t part = 0; part < kParts; ++part) {
      const std::uint32_t at = i + part * kDoubleLanes;
      const auto error = loadDoubles(decoded + at) - loadDoubles(values + at);
      squaredParts[part] = squaredParts[part] + error * error;
      largestParts[part] = hn::Max(largestParts[part], hn::Abs(error));
    }
  }
  ErrorSums sums;
  for (std::uint32_t part = 0; part < kParts; ++part) {
    hn::StoreU(squaredParts[part], DoubleLanes(), sums.squared + part * kDoubleLanes);
    hn::StoreU(largestParts[part], DoubleLanes(), sums.largest + part * kDoubleLanes);
  }
  sums.setErrors(candidate);
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
