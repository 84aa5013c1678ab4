// Which of mode 7's partitions promise most: what would remain of each block's deviations if both of its sets of texels
// had their best lines.
#if defined(BILLOW_COMPILER_ENCODE_BC7_PARTITIONS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BILLOW_COMPILER_ENCODE_BC7_PARTITIONS_INL_H
#undef BILLOW_COMPILER_ENCODE_BC7_PARTITIONS_INL_H
#else
#define BILLOW_COMPILER_ENCODE_BC7_PARTITIONS_INL_H
#endif

#include "billow/format/bc7_tables.h"
#include "encode/bc7_fit-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {

inline constexpr int kMaxRanked = 32;

// Sums over a set of texels, from which the residual about the best line follows: products of two channels' deviations
// from the middle of the range, deviations, counts.
template <Weights kWeights>
struct SetMoments {
  static constexpr int kCounts = kWeights == Weights::channel ? 4 : 1;
  static constexpr int kSize = kPairs + 4 + kCounts;
  V sum[kSize];

  HWY_INLINE V count(int c) const { return sum[kPairs + 4 + (kCounts == 4 ? c : 0)]; }
};

// The moments of every set of texels within each row of four.
template <Weights kWeights>
struct RowMoments {
  static constexpr int kSize = SetMoments<kWeights>::kSize;
  alignas(64) float sum[4][16][kSize][kLanes];

  explicit RowMoments(const Plane<4, kWeights>& plane) {
    for (int row = 0; row < 4; ++row) {
      for (int m = 0; m < kSize; ++m) store(all(0.0f), sum[row][0][m]);
      for (int i = 0; i < 4; ++i) addTexel(plane, row, i);
    }
  }

  HWY_INLINE void addTexel(const Plane<4, kWeights>& plane, int row, int i) {
    const int texel = 4 * row + i;
    SetMoments<kWeights> moments;
    V deviation[4];
    for (int c = 0; c < 4; ++c) deviation[c] = plane.weigh(plane.at(c, texel) - all(127.5f), c, texel);
    for (int c = 0; c < 4; ++c) {
      for (int d = c; d < 4; ++d) moments.sum[kPairOf[c][d]] = deviation[c] * deviation[d];
      moments.sum[kPairs + c] = deviation[c];
    }
    for (int c = 0; c < SetMoments<kWeights>::kCounts; ++c) {
      moments.sum[kPairs + 4 + c] = plane.weigh(all(1.0f), c, texel);
    }
    for (int set = 0; set < 1 << i; ++set) {
      for (int m = 0; m < kSize; ++m) store(load(sum[row][set][m]) + moments.sum[m], sum[row][set | 1 << i][m]);
    }
  }

  HWY_INLINE SetMoments<kWeights> of(std::uint32_t texels) const {
    SetMoments<kWeights> moments;
    for (int m = 0; m < kSize; ++m) {
      moments.sum[m] = (load(sum[0][texels & 15][m]) + load(sum[1][texels >> 4 & 15][m])) +
                       (load(sum[2][texels >> 8 & 15][m]) + load(sum[3][texels >> 12][m]));
    }
    return moments;
  }
};

// The trace of the covariance less its largest eigenvalue, by one step of power iteration.
template <Weights kWeights>
HWY_INLINE V residual(const SetMoments<kWeights>& moments) {
  V covariance[kPairs];
  V inverse = all(0.0f);
  for (int c = 0; c < 4; ++c) {
    if (c == 0 || kWeights == Weights::channel) inverse = all(1.0f) / max(moments.count(c), all(1.0f));
    const V mean = moments.sum[kPairs + c] * inverse;
    for (int d = c; d < 4; ++d) {
      covariance[kPairOf[c][d]] = moments.sum[kPairOf[c][d]] - moments.sum[kPairs + d] * mean;
    }
  }
  V axis[4], image[4];
  largestRow<4>(covariance, axis);
  multiply<4>(covariance, axis, image);
  V squares = all(0.0f), along = all(0.0f), trace = all(0.0f);
  for (int c = 0; c < 4; ++c) {
    squares = squares + axis[c] * axis[c];
    along = along + image[c] * axis[c];
    trace = trace + covariance[kPairOf[c][c]];
  }
  const M hasAxis = squares > all(1e-6f);
  return trace - select(hasAxis, along / select(hasAxis, squares, all(1.0f)), all(0.0f));
}

struct RankedPartitions {
  V number[kMaxRanked];
  V residual[kMaxRanked];  // ascending
};

// The best `wanted` of the first `count` partitions.
template <Weights kWeights>
HWY_INLINE void rankPartitions(const Plane<4, kWeights>& plane, int count, int wanted, RankedPartitions& ranked) {
  const RowMoments<kWeights> rows(plane);
  const SetMoments<kWeights> whole = rows.of(0xffff);
  for (int k = 0; k < wanted; ++k) {
    ranked.number[k] = all(0.0f);
    ranked.residual[k] = all(1e30f);
  }
  for (int p = 0; p < count; ++p) {
    const SetMoments<kWeights> second = rows.of(format::kBc7Partitions2[p]);
    SetMoments<kWeights> first;
    for (int m = 0; m < first.kSize; ++m) first.sum[m] = whole.sum[m] - second.sum[m];
    V left = residual(first) + residual(second);
    V number = all(static_cast<float>(p));
    for (int k = 0; k < wanted; ++k) {
      const M better = left < ranked.residual[k];
      const V worse = select(better, ranked.residual[k], left);
      const V worseNumber = select(better, ranked.number[k], number);
      ranked.residual[k] = select(better, left, ranked.residual[k]);
      ranked.number[k] = select(better, number, ranked.number[k]);
      left = worse;
      number = worseNumber;
    }
  }
}

}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
