// Modes 4 and 5: one line through three channels, the fourth on its own. For blocks with one slice unlike the others.
#include "encode/bc7_block.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encode/bc7_mode45.cpp"
#include <hwy/foreach_target.h>

#include "encode/bc7_fit-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {
namespace {

using Mode5Color = LineFormat<7, false, 3>;
using Mode5Separate = LineFormat<8, false, 3>;
using Mode4Color = LineFormat<5, false, 3>;
using Mode4Separate = LineFormat<6, false, 7>;
using Mode4ColorSecond = LineFormat<5, false, 7>;
using Mode4SeparateSecond = LineFormat<6, false, 3>;

// kLanes blocks whose channel `rotation` - 1 has changed places with channel 3, rotations by lane.
struct Rotated {
  alignas(32) float value[4][16][8];
  alignas(32) float weight[4][16][8];
};

template <Weights kWeights>
void rotate(const BlockTexels& texels, std::uint32_t lane, V rotation, Rotated& to) {
  for (int i = 0; i < 16; ++i) {
    V separate = load(&texels.value[3][i][lane]);
    V separateWeight = all(1.0f);
    if constexpr (kWeights == Weights::channel) separateWeight = load(&texels.weight[3][i][lane]);
    const V value3 = separate;
    const V weight3 = separateWeight;
    for (int c = 0; c < 3; ++c) {
      const M isSeparate = rotation == all(static_cast<float>(c + 1));
      const V value = load(&texels.value[c][i][lane]);
      store(select(isSeparate, value3, value), to.value[c][i]);
      separate = select(isSeparate, value, separate);
      if constexpr (kWeights == Weights::channel) {
        const V weight = load(&texels.weight[c][i][lane]);
        store(select(isSeparate, weight3, weight), to.weight[c][i]);
        separateWeight = select(isSeparate, weight, separateWeight);
      }
    }
    store(separate, to.value[3][i]);
    if constexpr (kWeights == Weights::channel) store(separateWeight, to.weight[3][i]);
  }
}

template <int kChannels, Weights kWeights>
struct Part {
  Plane<kChannels, kWeights> plane;
  Guesses<kChannels> guesses;

  Part(const Rotated& rotated, int firstChannel, const Bc7Search& search) {
    for (int c = 0; c < kChannels; ++c) {
      plane.value[c] = rotated.value[firstChannel + c][0];
      plane.weight[c] = rotated.weight[firstChannel + c][0];
    }
    plane.sum();
    guesses = guessEnds(plane, search);
  }
};

HWY_INLINE void blend(M condition, V value, float* to) {
  store(select(condition, value, load(to)), to);
}

template <class ColorFormat, class SeparateFormat, Weights kWeights>
void tryMode(const Part<3, kWeights>& color, const Part<1, kWeights>& separate, std::uint32_t lane, float mode,
             V rotation, float colorIsSecond, const Bc7Search& search, Bc7Fits& fits) {
  const LineFit<3> line = fitLine<ColorFormat>(color.plane, color.guesses, search);
  const LineFit<1> segment = fitLine<SeparateFormat>(separate.plane, separate.guesses, search);
  const V error = line.error + segment.error;
  const M better = error < load(&fits.error[lane]);
  if (!any(better)) return;
  blend(better, all(mode), &fits.mode[lane]);
  blend(better, rotation, &fits.rotation[lane]);
  blend(better, all(colorIsSecond), &fits.colorIsSecond[lane]);
  blend(better, error, &fits.error[lane]);
  for (int c = 0; c < 4; ++c) {
    blend(better, c < 3 ? line.ends.first[c] : segment.ends.first[0], &fits.first[0][c][lane]);
    blend(better, c < 3 ? line.ends.second[c] : segment.ends.second[0], &fits.second[0][c][lane]);
  }
  const auto projectColor = projector(color.plane, line.ends);
  const auto projectSeparate = projector(separate.plane, segment.ends);
  for (int i = 0; i < 16; ++i) {
    blend(better, stepAt(projectColor(i), ColorFormat::kLevels), &fits.step[i][lane]);
    blend(better, stepAt(projectSeparate(i), SeparateFormat::kLevels), &fits.separateStep[i][lane]);
  }
}

template <Weights kWeights>
void tryRotation(const BlockTexels& texels, std::uint32_t lane, V rotation, const Bc7Search& search, Bc7Fits& fits) {
  Rotated rotated;
  rotate<kWeights>(texels, lane, rotation, rotated);
  const Part<3, kWeights> color(rotated, 0, search);
  const Part<1, kWeights> separate(rotated, 3, search);
  tryMode<Mode4Color, Mode4Separate, kWeights>(color, separate, lane, 4, rotation, 0, search, fits);
  tryMode<Mode4ColorSecond, Mode4SeparateSecond, kWeights>(color, separate, lane, 4, rotation, 1, search, fits);
  if (!search.mode5) return;
  tryMode<Mode5Color, Mode5Separate, kWeights>(color, separate, lane, 5, rotation, 0, search, fits);
}

// The rotation that takes out the channel which one line, mode 6's, serves worst.
template <Weights kWeights>
V worstServed(const BlockTexels& texels, std::uint32_t lane, const Bc7Fits& fits) {
  V worst = all(-1.0f);
  V rotation = all(0.0f);
  for (int c = 0; c < 4; ++c) {
    const V first = load(&fits.first[0][c][lane]);
    const V span = load(&fits.second[0][c][lane]) - first;
    V error = all(0.0f);
    for (int i = 0; i < 16; ++i) {
      const V position = load(&fits.step[i][lane]) * all(1.0f / 15.0f);
      const V difference = first + position * span - load(&texels.value[c][i][lane]);
      V square = difference * difference;
      if constexpr (kWeights == Weights::channel) square = square * load(&texels.weight[c][i][lane]);
      error = error + square;
    }
    const M worse = error > worst;
    worst = select(worse, error, worst);
    rotation = select(worse, all(c == 3 ? 0.0f : static_cast<float>(c + 1)), rotation);
  }
  return rotation;
}

template <Weights kWeights>
void tryLanes(const BlockTexels& texels, std::uint32_t lane, const Bc7Search& search, Bc7Fits& fits) {
  if (search.rotations < 4) {
    tryRotation<kWeights>(texels, lane, worstServed<kWeights>(texels, lane, fits), search, fits);
    return;
  }
  for (int r = 0; r < 4; ++r) tryRotation<kWeights>(texels, lane, all(static_cast<float>(r)), search, fits);
}

void tryModes4And5(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits) {
  forEachLane(texels, [&](std::uint32_t lane, auto weights) { tryLanes<weights()>(texels, lane, search, fits); });
}

}  // namespace
}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace billow::compiler {

HWY_EXPORT(tryModes4And5);

void tryModes4And5(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits) {
  HWY_DYNAMIC_DISPATCH(tryModes4And5)(texels, search, fits);
}

}  // namespace billow::compiler
#endif  // HWY_ONCE
