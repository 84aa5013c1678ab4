// Mode 7: two lines, each for one half of a partition of the texels, four steps, ends of five bits and a p-bit.
#include "encode/bc7_block.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "encode/bc7_mode7.cpp"
#include <hwy/foreach_target.h>

#include "encode/bc7_partitions-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {
namespace {

using Mode7 = LineFormat<6, true, 3>;

// Of the texels in one half of each block's partition.
template <Weights kWeights>
struct Subset {
  static constexpr Weights kSubsetWeights = kWeights == Weights::none ? Weights::texel : Weights::channel;
  static constexpr int kWeightChannels = kWeights == Weights::none ? 1 : 4;
  alignas(32) float weight[kWeightChannels][16][8];
  Plane<4, kSubsetWeights> plane;

  // `inSubset`: by texel and lane, 0 or 1.
  HWY_INLINE void set(const Plane<4, kWeights>& whole, const float inSubset[16][8]) {
    for (int c = 0; c < kWeightChannels; ++c) {
      for (int i = 0; i < 16; ++i) store(whole.weigh(load(inSubset[i]), c, i), weight[c][i]);
    }
    for (int c = 0; c < 4; ++c) {
      plane.value[c] = whole.value[c];
      plane.weight[c] = weight[kWeightChannels == 4 ? c : 0][0];
    }
  }
};

HWY_INLINE void subsets(V partition, float first[16][8], float second[16][8]) {
  using IntLanes = hn::Rebind<std::uint32_t, FloatLanes>;
  float numbers[kLanes];
  std::uint32_t texels[kLanes];
  store(partition, numbers);
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) {
    texels[lane] = format::kBc7Partitions2[static_cast<std::uint32_t>(numbers[lane])];
  }
  const auto bits = hn::LoadU(IntLanes(), texels);
  for (int i = 0; i < 16; ++i) {
    const M isSecond = hn::RebindMask(FloatLanes(), hn::TestBit(bits, hn::Set(IntLanes(), 1u << i)));
    store(select(isSecond, all(0.0f), all(1.0f)), first[i]);
    store(select(isSecond, all(1.0f), all(0.0f)), second[i]);
  }
}

HWY_INLINE void blend(M condition, V value, float* to) {
  store(select(condition, value, load(to)), to);
}

template <Weights kWeights>
struct PartitionFit {
  V partition;
  alignas(32) float inFirst[16][8];
  alignas(32) float inSecond[16][8];
  Subset<kWeights> half[2];
  LineFit<4> line[2];

  HWY_INLINE void fit(const Plane<4, kWeights>& plane, V number, const Bc7Search& search) {
    partition = number;
    subsets(partition, inFirst, inSecond);
    half[0].set(plane, inFirst);
    half[1].set(plane, inSecond);
    half[0].plane.sum();
    for (int c = 0; c < 4; ++c) {
      half[1].plane.count[c] = plane.count[c] - half[0].plane.count[c];
      half[1].plane.total[c] = plane.total[c] - half[0].plane.total[c];
    }
    for (int h = 0; h < 2; ++h) line[h] = fitLine<Mode7>(half[h].plane, guessEnds(half[h].plane, search), search);
  }
  HWY_INLINE V error() const { return line[0].error + line[1].error; }

  void keep(std::uint32_t lane, M promising, Bc7Fits& fits) const {
    const M better = both(promising, error() < load(&fits.error[lane]));
    if (!any(better)) return;
    blend(better, all(7.0f), &fits.mode[lane]);
    blend(better, partition, &fits.partition[lane]);
    blend(better, error(), &fits.error[lane]);
    for (int h = 0; h < 2; ++h) {
      for (int c = 0; c < 4; ++c) {
        blend(better, line[h].ends.first[c], &fits.first[h][c][lane]);
        blend(better, line[h].ends.second[c], &fits.second[h][c][lane]);
      }
    }
    const auto project0 = projector(half[0].plane, line[0].ends);
    const auto project1 = projector(half[1].plane, line[1].ends);
    for (int i = 0; i < 16; ++i) {
      const V position = select(load(inSecond[i]) > all(0.0f), project1(i), project0(i));
      blend(better, stepAt(position, Mode7::kLevels), &fits.step[i][lane]);
    }
  }
};

template <Weights kWeights>
void tryLanes(const BlockTexels& texels, std::uint32_t lane, const Bc7Search& search, Bc7Fits& fits) {
  Plane<4, kWeights> plane;
  for (int c = 0; c < 4; ++c) {
    plane.value[c] = &texels.value[c][0][lane];
    plane.weight[c] = &texels.weight[c][0][lane];
  }
  plane.sum();
  RankedPartitions ranked;
  rankPartitions(plane, search.ranked, search.partitions, ranked);
  for (int n = 0; n < search.partitions; ++n) {
    // The steps between cannot gain back what the lines leave.
    const M promising = ranked.residual[n] < load(&fits.error[lane]);
    if (!any(promising)) return;
    PartitionFit<kWeights> fit;
    fit.fit(plane, ranked.number[n], search);
    fit.keep(lane, promising, fits);
  }
}

void tryMode7(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits) {
  forEachLane(texels, [&](std::uint32_t lane, auto weights) { tryLanes<weights()>(texels, lane, search, fits); });
}

}  // namespace
}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace billow::compiler {

HWY_EXPORT(tryMode7);

void tryMode7(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits) {
  HWY_DYNAMIC_DISPATCH(tryMode7)(texels, search, fits);
}

}  // namespace billow::compiler
#endif  // HWY_ONCE
