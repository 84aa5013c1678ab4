// Mode 6: one line, 16 steps, ends of seven bits and a p-bit. The mode that most smooth blocks want.
#include "encode/bc7_block.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encode/bc7_mode6.cpp"
#include <hwy/foreach_target.h>

#include "encode/bc7_fit-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {
namespace {

using Mode6 = LineFormat<8, true, 15>;

template <Weights kWeights>
void fitLanes(const BlockTexels& texels, std::uint32_t lane, const Bc7Search& search, Bc7Fits& fits) {
  Plane<4, kWeights> plane;
  for (int c = 0; c < 4; ++c) {
    plane.value[c] = &texels.value[c][0][lane];
    plane.weight[c] = &texels.weight[c][0][lane];
  }
  plane.sum();
  const LineFit<4> fit = fitLine<Mode6>(plane, guessEnds(plane, search), search);
  for (int c = 0; c < 4; ++c) {
    store(fit.ends.first[c], &fits.first[0][c][lane]);
    store(fit.ends.second[c], &fits.second[0][c][lane]);
  }
  const auto project = projector(plane, fit.ends);
  for (int i = 0; i < 16; ++i) store(stepAt(project(i), Mode6::kLevels), &fits.step[i][lane]);
  store(fit.error, &fits.error[lane]);
  store(all(6.0f), &fits.mode[lane]);
}

void fitMode6(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits) {
  forEachLane(texels, [&](std::uint32_t lane, auto weights) { fitLanes<weights()>(texels, lane, search, fits); });
}

}  // namespace
}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace billow::compiler {

HWY_EXPORT(fitMode6);

void fitMode6(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits) {
  HWY_DYNAMIC_DISPATCH(fitMode6)(texels, search, fits);
}

}  // namespace billow::compiler
#endif  // HWY_ONCE
