// Bricks that store a texel a voxel as it is, and bricks that store none.
#include "encode/wide/wide_encoder.h"

namespace billow::compiler {
namespace {

// Fills `out` for texels of 8 or 16 bits. Where voxels are inactive, texel 0 is theirs and active ones start at 1.
void encodeTexels(const BrickSource& brick, std::uint32_t encoding, std::uint32_t last, Candidate& out) {
  std::uint32_t first = brick.activeCount < format::kBrickVoxels ? 1 : 0;
  const WideEncoder& wide = wideEncoder();
  const ValueRange values = wide.activeRange(brick);
  TexelRange range = coverRange(values, first, last);
  if (!(range.lo >= std::numeric_limits<float>::lowest())) {
    first = 0;
    range = coverRange(values, first, last);
  }
  out.encoding = encoding;
  out.texelMask = first != 0;
  out.lo = range.lo;
  out.scale = range.scale;
  TexelTargets targets;
  TexelWeights weights;
  wide.texelTargets(brick, range, first, last, targets);
  wide.texelWeights(brick, weights);
  format::Texels texels;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const float active = targets[i] + 0.5f;
    texels[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(weights[i] != 0.0f ? active : 0.0f));
  }
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const std::uint32_t texel = texels[format::voxelIndex(i & 7, i >> 3 & 7, i >> 6)];
    out.payload[i] = static_cast<std::byte>(texel & 0xff);
    if (encoding == format::kEncodingR16) out.payload[format::kBrickVoxels + i] = static_cast<std::byte>(texel >> 8);
  }
  wideEncoder().measure(brick, texels, out);
}

}  // namespace

void encodeConstant(const BrickSource& brick, Candidate& out) {
  TexelWeights weights;
  wideEncoder().texelWeights(brick, weights);
  // Independent sums, so that additions overlap; their order is fixed.
  constexpr std::uint32_t kSums = 8;
  double sums[kSums] = {};
  for (std::uint32_t i = 0; i < format::kBrickVoxels; i += kSums) {
    for (std::uint32_t j = 0; j < kSums; ++j) {
      sums[j] += static_cast<double>(weights[i + j]) * static_cast<double>((*brick.values)[i + j]);
    }
  }
  const double total = ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]));
  out.encoding = format::kEncodingConstant;
  out.texelMask = false;
  out.lo = brick.activeCount == 0 ? 0.0f : static_cast<float>(total / brick.activeCount);
  out.scale = 0;
  format::Texels texels;
  texels.fill(0);
  wideEncoder().measure(brick, texels, out);
}

void encodeR8(const BrickSource& brick, Candidate& out) {
  encodeTexels(brick, format::kEncodingR8, 255, out);
}

void encodeR16(const BrickSource& brick, Candidate& out) {
  encodeTexels(brick, format::kEncodingR16, 65535, out);
}

}  // namespace billow::compiler
