// Bricks that store nothing: one value for every active voxel.
#include <cmath>

#include "encode/brick_lanes.h"

namespace billow::compiler {

void encodeConstant(const BrickSource& brick, Candidate& out) {
  TexelWeights weights;
  texelWeights(brick, weights);
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
  measure(brick, texels, out);
  if (!(out.squaredError > 0)) return;
  // Rounding the mean by d adds d^2 a voxel: at most a 64th of the error.
  out.lo = shorten(static_cast<double>(out.lo), std::sqrt(out.squaredError / brick.activeCount / 64));
  measure(brick, texels, out);
}

}  // namespace billow::compiler
