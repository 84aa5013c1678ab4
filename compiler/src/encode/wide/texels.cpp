// Loops over a brick's voxels, written so that compilers vectorise them: independent sums, so that additions overlap,
// in a fixed order.
#include <limits>

#include "encode/wide/parts.h"

namespace billow::compiler::BILLOW_WIDE {

// Not by std::min_element and the like: their code may be merged with that for other machines.
ValueRange activeRange(const BrickSource& brick) {
  if (brick.activeCount == 0) return {};
  TexelWeights weights;
  texelWeights(brick, weights);
  const float* values = brick.values->data();
  Wide low = all(std::numeric_limits<float>::max());
  Wide high = all(std::numeric_limits<float>::lowest());
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kWideLanes) {
    const Wide value = load(values + i);
    const WideInt active = load(weights.data() + i) > all(0.0f);
    low = select(active & (value < low), value, low);
    high = select(active & (value > high), value, high);
  }
  float lows[kWideLanes], highs[kWideLanes];
  store(low, lows);
  store(high, highs);
  ValueRange range = {lows[0], highs[0]};
  for (std::uint32_t lane = 1; lane < kWideLanes; ++lane) {
    range.min = lows[lane] < range.min ? lows[lane] : range.min;
    range.max = highs[lane] > range.max ? highs[lane] : range.max;
  }
  return range;
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
  texelWeights(brick, weights);
  const Wide inactive = all(static_cast<float>(first));
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kWideLanes) {
    store(select(load(weights.data() + i) > all(0.0f), load(to + i), inactive), to + i);
  }
}

void texelWeights(const BrickSource& brick, TexelWeights& weights) {
  static constexpr std::uint32_t kBits[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  float* to = weights.data();
  for (std::uint32_t byte = 0; byte < format::kBrickVoxels / 8; ++byte) {
    const std::uint32_t bits = brick.active->words[byte >> 2] >> (8 * (byte & 3));
    for (std::uint32_t i = 0; i < 8; ++i) to[byte * 8 + i] = (bits & kBits[i]) != 0 ? 1.0f : 0.0f;
  }
}

namespace {

// In double: the difference of any two floats is finite there. Eight sums whatever the vectors' width, so that every
// machine adds in the same order.
void sumErrors(const float* decoded, const float* values, Candidate& candidate) {
  constexpr std::uint32_t kParts = kWideLanes / kDoubleLanes;
  Doubles squared[kParts] = {};
  Doubles largest[kParts] = {};
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kWideLanes) {
    for (std::uint32_t part = 0; part < kParts; ++part) {
      const std::uint32_t at = i + part * kDoubleLanes;
      const Doubles error = loadDoubles(decoded + at) - loadDoubles(values + at);
      squared[part] += error * error;
      largest[part] = max(largest[part], max(error, -error));
    }
  }
  double sums[kWideLanes], worst[kWideLanes];
  std::memcpy(sums, squared, sizeof sums);
  std::memcpy(worst, largest, sizeof worst);
  candidate.squaredError = 0;
  double most = 0;
  for (std::uint32_t j = 0; j < kWideLanes; ++j) {
    candidate.squaredError += sums[j];
    most = worst[j] > most ? worst[j] : most;
  }
  constexpr double kLargest = std::numeric_limits<float>::max();
  candidate.maxError = static_cast<float>(most < kLargest ? most : kLargest);
}

}  // namespace

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
    texelWeights(brick, weights);
    for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kWideLanes) {
      store(select(load(weights.data() + i) > all(0.0f), load(decoded + i), load(values + i)), decoded + i);
    }
  }
  sumErrors(decoded, values, candidate);
}

void arrange(const BrickTargets& targets, std::uint32_t packedAxis, WideBrick& wide) {
  // Strides in voxelIndex of the stored x, y and z.
  const std::uint32_t strideX = packedAxis == 0 ? 1 : 64;
  const std::uint32_t strideY = packedAxis == 1 ? 1 : 8;
  const std::uint32_t strideZ = packedAxis == 0 ? 64 : packedAxis == 1 ? 8 : 1;
  wide.allActive = targets.allActive;
  const auto copy = [&](const float* from, float(*to)[16][8]) {
    for (std::uint32_t lane = 0; lane < kWideLanes; ++lane) {
      const std::uint32_t corner = 4 * ((lane & 1) * strideX + (lane >> 1 & 1) * strideY + (lane >> 2) * strideZ);
      for (std::uint32_t c = 0; c < 4; ++c) {
        for (std::uint32_t i = 0; i < 16; ++i) {
          to[c][i][lane] = from[corner + c * strideZ + (i & 3) * strideX + (i >> 2) * strideY];
        }
      }
    }
  };
  copy(targets.value.data(), wide.value);
  if (!wide.allActive) copy(targets.weight.data(), wide.weight);
}

}  // namespace billow::compiler::BILLOW_WIDE
