#include "encode/wide/wide_encoder.h"

#include <array>

namespace billow::compiler {

std::span<const WideEncoder* const> wideEncoders() {
#ifdef BILLOW_HAS_AVX2
  static constexpr std::array<const WideEncoder*, 2> kBoth = {&avx2::kWideEncoder, &baseline::kWideEncoder};
  static const bool hasAvx2 = __builtin_cpu_supports("avx2") != 0;
  return std::span<const WideEncoder* const>(kBoth).subspan(hasAvx2 ? 0 : 1);
#else
  static constexpr std::array<const WideEncoder*, 1> kOne = {&baseline::kWideEncoder};
  return kOne;
#endif
}

const WideEncoder& wideEncoder() {
  return *wideEncoders().front();
}

BrickTargets::BrickTargets(const BrickSource& brick) : allActive(brick.activeCount == format::kBrickVoxels) {
  const WideEncoder& wide = wideEncoder();
  range = coverRange(wide.activeRange(brick), 0, 255);
  wide.texelTargets(brick, range, 0, 255, value);
  if (!allActive) wide.texelWeights(brick, weight);
}

}  // namespace billow::compiler
