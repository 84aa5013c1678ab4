// Fitting the 16 texels of each block by a line of evenly spaced steps: what all BC7 modes have in common.
#if defined(BILLOW_COMPILER_ENCODE_BC7_LINES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BILLOW_COMPILER_ENCODE_BC7_LINES_INL_H
#undef BILLOW_COMPILER_ENCODE_BC7_LINES_INL_H
#else
#define BILLOW_COMPILER_ENCODE_BC7_LINES_INL_H
#endif

#include "encode/bc7_block.h"
#include "encode/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {

// Which texels count: all, some in all their channels (a subset), or some channels of some (inactive voxels).
enum class Weights { none, texel, channel };

// Texels of kLanes blocks by channel, eight floats apart; values in [0, 255], weights 0 or 1.
template <int kChannels_, Weights kWeights_>
struct Plane {
  static constexpr int kChannels = kChannels_;
  static constexpr Weights kWeights = kWeights_;
  const float* value[kChannels];
  const float* weight[kChannels];  // the first alone where kWeights is texel
  V count[kChannels];
  V total[kChannels];

  HWY_INLINE V at(int c, int i) const { return load(value[c] + 8 * i); }
  HWY_INLINE V weightAt(int c, int i) const { return load(weight[kWeights == Weights::texel ? 0 : c] + 8 * i); }
  HWY_INLINE V weigh(V quantity, int c, int i) const {
    if constexpr (kWeights == Weights::none) {
      return quantity;
    } else {
      return quantity * weightAt(c, i);
    }
  }
  // To be called once value and weight are set.
  HWY_INLINE void sum() {
    for (int c = 0; c < kChannels; ++c) {
      count[c] = all(kWeights == Weights::none ? 16.0f : 0.0f);
      total[c] = all(0.0f);
      for (int i = 0; i < 16; ++i) {
        if constexpr (kWeights != Weights::none) count[c] = count[c] + weightAt(c, i);
        total[c] = total[c] + weigh(at(c, i), c, i);
      }
    }
  }
};

// How a mode stores a line. kBits: of an end's channel, the p-bit that all channels share included.
template <int kBits_, bool kHasP_, int kLevels_>
struct LineFormat {
  static constexpr int kBits = kBits_;
  static constexpr bool kHasP = kHasP_;
  static constexpr float kLevels = kLevels_;  // the last step
};

template <int kChannels>
struct Ends {
  V first[kChannels], second[kChannels];
};

template <int kChannels>
struct LineFit {
  Ends<kChannels> ends;  // as the decoder expands them to eight bits
  V error;
};

HWY_INLINE V reciprocalOrZero(V value) {
  const M counts = value > all(1e-6f);
  return select(counts, all(1.0f) / select(counts, value, all(1.0f)), all(0.0f));
}

// Where texel i projects on a line, in units of the direction; 0 where it has no channel that counts.
template <class P>
struct Projector {
  const P& plane;
  V origin[P::kChannels];
  V direction[P::kChannels];
  V inverse;  // unless channels are weighted, of the direction's squared length

  HWY_INLINE V squares(int i) const {
    V sum = all(0.0f);
    for (int c = 0; c < P::kChannels; ++c) {
      const V square = direction[c] * direction[c];
      sum = sum + (P::kWeights == Weights::channel ? plane.weigh(square, c, i) : square);
    }
    return sum;
  }
  HWY_INLINE void prepare() {
    if constexpr (P::kWeights != Weights::channel) inverse = reciprocalOrZero(squares(0));
  }
  HWY_INLINE V operator()(int i) const {
    V along = all(0.0f);
    for (int c = 0; c < P::kChannels; ++c) {
      const V part = direction[c] * (plane.at(c, i) - origin[c]);
      along = along + (P::kWeights == Weights::channel ? plane.weigh(part, c, i) : part);
    }
    if constexpr (P::kWeights == Weights::channel) return along * reciprocalOrZero(squares(i));
    return along * inverse;
  }
};

template <class P>
HWY_INLINE Projector<P> projector(const P& plane, const Ends<P::kChannels>& ends) {
  Projector<P> project{plane, {}, {}, all(0.0f)};
  for (int c = 0; c < P::kChannels; ++c) {
    project.origin[c] = ends.first[c];
    project.direction[c] = ends.second[c] - ends.first[c];
  }
  project.prepare();
  return project;
}

HWY_INLINE V stepAt(V position, float levels) {
  return round(clamp(position * all(levels), 0.0f, levels));
}
// 64ths along the line at which the decoder puts a step.
HWY_INLINE V stepWeight(V step, float levels) {
  return round(step * all(64.0f / levels));
}

// What least squares needs of the texels: sums of t, t^2 and t times value, with t in 64ths.
template <int kChannels>
struct LineMoments {
  V t[kChannels], tt[kChannels];  // the first alone unless channels are weighted
  V tv[kChannels];
};

// Gives each texel its nearest step; the squared error of what the decoder makes of that. Ends are integers.
template <class Format, class P>
HWY_INLINE V lineError(const P& plane, const Ends<P::kChannels>& ends, LineMoments<P::kChannels>* moments) {
  constexpr int kC = P::kChannels;
  const Projector<P> project = projector(plane, ends);
  V start[kC], span[kC];
  for (int c = 0; c < kC; ++c) {
    // Exact in floats: integers below 2^24 and a division by a power of two.
    start[c] = ends.first[c] + all(0.5f);
    span[c] = project.direction[c] * all(1.0f / 64.0f);
  }
  V error = all(0.0f);
  for (int i = 0; i < 16; ++i) {
    const V weight = stepWeight(stepAt(project(i), Format::kLevels), Format::kLevels);
    V squares = all(0.0f);
    for (int c = 0; c < kC; ++c) {
      const V difference = truncate(start[c] + weight * span[c]) - plane.at(c, i);
      const V square = difference * difference;
      squares = squares + (P::kWeights == Weights::channel ? plane.weigh(square, c, i) : square);
    }
    error = error + (P::kWeights == Weights::texel ? plane.weigh(squares, 0, i) : squares);
    if (moments == nullptr) continue;
    for (int c = 0; c < kC; ++c) {
      if (c == 0 || P::kWeights == Weights::channel) {
        const V weighted = plane.weigh(weight, c, i);
        moments->t[c] = moments->t[c] + weighted;
        moments->tt[c] = moments->tt[c] + weighted * weight;
      }
      moments->tv[c] = moments->tv[c] + plane.weigh(weight, c, i) * plane.at(c, i);
    }
  }
  return error;
}

// The ends that fit best where each texel keeps its step; those given in channels where that is undetermined. Linear
// regression: with t the position and s = 1 - t, the normal equations' sums of s^2, st, t^2.
template <class P>
HWY_INLINE void leastSquares(const P& plane, const LineMoments<P::kChannels>& moments, Ends<P::kChannels>& ends) {
  constexpr float kScale = 1.0f / 64.0f;
  for (int c = 0; c < P::kChannels; ++c) {
    const int shared = P::kWeights == Weights::channel ? c : 0;
    const V t = moments.t[shared] * all(kScale);
    const V tt = moments.tt[shared] * all(kScale * kScale);
    const V tv = moments.tv[c] * all(kScale);
    const V st = t - tt;
    const V ss = (plane.count[c] - t) - st;
    const V sv = plane.total[c] - tv;
    const V determinant = ss * tt - st * st;
    const M solvable = determinant > all(1e-3f);
    const V inverse = all(1.0f) / select(solvable, determinant, all(1.0f));
    const V first = clamp((sv * tt - tv * st) * inverse, 0.0f, 255.0f);
    const V second = clamp((tv * ss - sv * st) * inverse, 0.0f, 255.0f);
    ends.first[c] = select(solvable, first, ends.first[c]);
    ends.second[c] = select(solvable, second, ends.second[c]);
  }
}

// Repeats the high bits of a kBits-wide integer below it, to fill eight.
template <int kBits>
HWY_INLINE V expandBits(V value) {
  if constexpr (kBits == 8) return value;
  constexpr float kUp = 1 << (8 - kBits);
  constexpr float kDown = 1.0f / static_cast<float>(1 << (2 * kBits - 8));
  return value * all(kUp) + truncate(value * all(kDown));
}

// The nearest end that can be stored with the p-bit `p` (0 or 1 in each lane). `end` in [0, 255].
template <class Format>
HWY_INLINE V quantiseWithP(V end, V p) {
  constexpr float kScale = static_cast<float>((1 << Format::kBits) - 1) / 255.0f;
  constexpr float kHighest = (1 << (Format::kBits - 1)) - 1;
  const V half = clamp((end * all(kScale) - p) * all(0.5f), 0.0f, kHighest);
  return expandBits<Format::kBits>(round(half) * all(2.0f) + p);
}

// The nearest that can be stored, with the p-bit that leaves the end nearest to where it was; channels of no count have
// no say.
template <class Format, int kChannels>
HWY_INLINE void quantise(const V end[kChannels], const V count[kChannels], V quantised[kChannels]) {
  if constexpr (!Format::kHasP) {
    constexpr float kScale = static_cast<float>((1 << Format::kBits) - 1) / 255.0f;
    for (int c = 0; c < kChannels; ++c) quantised[c] = expandBits<Format::kBits>(round(end[c] * all(kScale)));
  } else {
    V even[kChannels], odd[kChannels];
    V evenError = all(0.0f), oddError = all(0.0f);
    for (int c = 0; c < kChannels; ++c) {
      even[c] = quantiseWithP<Format>(end[c], all(0.0f));
      odd[c] = quantiseWithP<Format>(end[c], all(1.0f));
      evenError = evenError + (even[c] - end[c]) * (even[c] - end[c]) * count[c];
      oddError = oddError + (odd[c] - end[c]) * (odd[c] - end[c]) * count[c];
    }
    const M isOdd = oddError < evenError;
    for (int c = 0; c < kChannels; ++c) quantised[c] = select(isOdd, odd[c], even[c]);
  }
}

template <int kChannels>
HWY_INLINE void keepBetter(const Ends<kChannels>& ends, V error, LineFit<kChannels>& best) {
  const M better = error < best.error;
  for (int c = 0; c < kChannels; ++c) {
    best.ends.first[c] = select(better, ends.first[c], best.ends.first[c]);
    best.ends.second[c] = select(better, ends.second[c], best.ends.second[c]);
  }
  best.error = select(better, error, best.error);
}

}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
