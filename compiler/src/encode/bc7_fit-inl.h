// The search for one line: a first guess from the texels' principal axis, least squares, and single steps of the ends.
#if defined(BILLOW_COMPILER_ENCODE_BC7_FIT_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef BILLOW_COMPILER_ENCODE_BC7_FIT_INL_H
#undef BILLOW_COMPILER_ENCODE_BC7_FIT_INL_H
#else
#define BILLOW_COMPILER_ENCODE_BC7_FIT_INL_H
#endif

#include <type_traits>

#include "encode/bc7_lines-inl.h"

HWY_BEFORE_NAMESPACE();
namespace billow::compiler::HWY_NAMESPACE {

// Numbers of the pairs of up to four channels, a channel with itself included.
inline constexpr int kPairs = 10;
inline constexpr int kPairOf[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};

// Calls function(first of kLanes blocks, how their texels count) until all blocks are done.
template <class Function>
HWY_INLINE void forEachLane(const BlockTexels& texels, const Function& function) {
  for (std::uint32_t lane = 0; lane < kBlockLanes; lane += kLanes) {
    if (texels.allActive) {
      function(lane, std::integral_constant<Weights, Weights::none>());
    } else {
      function(lane, std::integral_constant<Weights, Weights::channel>());
    }
  }
}

// Divides by the largest component; 1 in all channels where there is none.
template <int kChannels>
HWY_INLINE void normalise(V axis[kChannels]) {
  V largest = all(0.0f);
  for (int c = 0; c < kChannels; ++c) largest = max(largest, hn::Abs(axis[c]));
  const M hasAxis = largest > all(1e-12f);
  const V inverse = all(1.0f) / select(hasAxis, largest, all(1.0f));
  for (int c = 0; c < kChannels; ++c) axis[c] = select(hasAxis, axis[c] * inverse, all(1.0f));
}

// The row of the largest variance: a first guess at the dominant eigenvector.
template <int kChannels>
HWY_INLINE V largestRow(const V covariance[kPairs], V axis[kChannels]) {
  V largest = covariance[0];
  for (int d = 0; d < kChannels; ++d) axis[d] = covariance[d];
  for (int c = 1; c < kChannels; ++c) {
    const V variance = covariance[kPairOf[c][c]];
    const M larger = variance > largest;
    largest = select(larger, variance, largest);
    for (int d = 0; d < kChannels; ++d) axis[d] = select(larger, covariance[kPairOf[c][d]], axis[d]);
  }
  return largest;
}

template <int kChannels>
HWY_INLINE void multiply(const V covariance[kPairs], const V axis[kChannels], V image[kChannels]) {
  for (int c = 0; c < kChannels; ++c) {
    image[c] = all(0.0f);
    for (int d = 0; d < kChannels; ++d) image[c] = image[c] + covariance[kPairOf[c][d]] * axis[d];
  }
}

// By power iteration.
template <int kChannels>
HWY_INLINE void dominantAxis(const V covariance[kPairs], V axis[kChannels]) {
  if constexpr (kChannels == 1) {
    axis[0] = all(1.0f);
    return;
  }
  largestRow<kChannels>(covariance, axis);
  for (int pass = 0; pass < 2; ++pass) {
    normalise<kChannels>(axis);
    V image[kChannels];
    multiply<kChannels>(covariance, axis, image);
    for (int c = 0; c < kChannels; ++c) axis[c] = image[c];
  }
  normalise<kChannels>(axis);
}

// The principal axis through the texels, from the lowest to the highest of their projections; `inset` of that length is
// left out at either end. Clamped to [0, 255].
template <class P>
HWY_INLINE Ends<P::kChannels> principalEnds(const P& plane, float inset) {
  constexpr int kC = P::kChannels;
  Projector<P> project{plane, {}, {}, all(0.0f)};
  V covariance[kPairs];
  for (V& sum : covariance) sum = all(0.0f);
  for (int c = 0; c < kC; ++c) project.origin[c] = plane.total[c] / max(plane.count[c], all(1.0f));
  for (int i = 0; i < 16; ++i) {
    V deviation[kC];
    for (int c = 0; c < kC; ++c) deviation[c] = plane.weigh(plane.at(c, i) - project.origin[c], c, i);
    for (int c = 0; c < kC; ++c) {
      for (int d = c; d < kC; ++d) covariance[kPairOf[c][d]] = covariance[kPairOf[c][d]] + deviation[c] * deviation[d];
    }
  }
  dominantAxis<kC>(covariance, project.direction);
  project.prepare();
  V low = all(0.0f), high = all(0.0f);
  for (int i = 0; i < 16; ++i) {
    V position = project(i);
    if constexpr (P::kWeights == Weights::texel) position = plane.weigh(position, 0, i);
    low = min(low, position);
    high = max(high, position);
  }
  const V margin = (high - low) * all(inset);
  low = low + margin;
  high = high - margin;
  Ends<kC> ends;
  for (int c = 0; c < kC; ++c) {
    ends.first[c] = clamp(project.origin[c] + project.direction[c] * low, 0.0f, 255.0f);
    ends.second[c] = clamp(project.origin[c] + project.direction[c] * high, 0.0f, 255.0f);
  }
  return ends;
}

// Least squares and requantisation in turns, from `ends`.
template <class Format, class P>
HWY_INLINE void refine(const P& plane, Ends<P::kChannels> ends, int passes, LineFit<P::kChannels>& best) {
  constexpr int kC = P::kChannels;
  for (int pass = 0;; ++pass) {
    Ends<kC> stored;
    quantise<Format, kC>(ends.first, plane.count, stored.first);
    quantise<Format, kC>(ends.second, plane.count, stored.second);
    if (pass == passes) {
      keepBetter(stored, lineError<Format>(plane, stored, nullptr), best);
      return;
    }
    LineMoments<kC> moments;
    for (int c = 0; c < kC; ++c) moments.t[c] = moments.tt[c] = moments.tv[c] = all(0.0f);
    keepBetter(stored, lineError<Format>(plane, stored, &moments), best);
    leastSquares(plane, moments, ends);
  }
}

// Every combination of p-bits about the least squares' ends of the best.
template <class Format, class P>
HWY_NOINLINE void tryAllP(const P& plane, LineFit<P::kChannels>& best) {
  constexpr int kC = P::kChannels;
  Ends<kC> ends = best.ends;
  LineMoments<kC> moments;
  for (int c = 0; c < kC; ++c) moments.t[c] = moments.tt[c] = moments.tv[c] = all(0.0f);
  lineError<Format>(plane, ends, &moments);
  leastSquares(plane, moments, ends);
  for (int combination = 0; combination < 4; ++combination) {
    Ends<kC> stored;
    for (int c = 0; c < kC; ++c) {
      stored.first[c] = quantiseWithP<Format>(ends.first[c], all(static_cast<float>(combination & 1)));
      stored.second[c] = quantiseWithP<Format>(ends.second[c], all(static_cast<float>(combination >> 1)));
    }
    keepBetter(stored, lineError<Format>(plane, stored, nullptr), best);
  }
}

// Moves each channel of each end by one that can be stored, up and down, while that helps.
template <class Format, class P>
HWY_NOINLINE void nudge(const P& plane, int rounds, LineFit<P::kChannels>& best) {
  constexpr float kStep = Format::kHasP ? 2 : 1;  // the p-bit stays
  constexpr float kNarrow = 1.0f / static_cast<float>(1 << (8 - Format::kBits));
  constexpr float kHighest = (1 << Format::kBits) - 1;
  for (int round = 0; round < rounds; ++round) {
    const V before = best.error;
    for (int move = 0; move < 4 * P::kChannels; ++move) {
      Ends<P::kChannels> ends = best.ends;
      V& end = (move & 1) != 0 ? ends.first[move >> 2] : ends.second[move >> 2];
      const V moved = truncate(end * all(kNarrow)) + all((move & 2) != 0 ? kStep : -kStep);
      const M possible = both(moved >= all(0.0f), moved <= all(kHighest));
      end = select(possible, expandBits<Format::kBits>(max(moved, all(0.0f))), end);
      keepBetter(ends, lineError<Format>(plane, ends, nullptr), best);
    }
    if (!any(best.error < before)) return;
  }
}

// First guesses at a line, which do not depend on its format.
template <int kChannels>
struct Guesses {
  Ends<kChannels> ends[4];
};

template <class P>
HWY_INLINE Guesses<P::kChannels> guessEnds(const P& plane, const Bc7Search& search) {
  static constexpr float kInsets[] = {0.0f, 0.12f, 0.25f, -0.1f};
  Guesses<P::kChannels> guesses;
  for (int start = 0; start < search.starts; ++start) guesses.ends[start] = principalEnds(plane, kInsets[start]);
  return guesses;
}

// As far as `search` goes.
template <class Format, class P>
HWY_INLINE LineFit<P::kChannels> fitLine(const P& plane, const Guesses<P::kChannels>& guesses,
                                         const Bc7Search& search) {
  LineFit<P::kChannels> best;
  for (int c = 0; c < P::kChannels; ++c) best.ends.first[c] = best.ends.second[c] = all(0.0f);
  best.error = all(1e30f);
  for (int start = 0; start < search.starts; ++start) refine<Format>(plane, guesses.ends[start], search.passes, best);
  if constexpr (Format::kHasP) {
    if (search.allPBits) tryAllP<Format>(plane, best);
  }
  if (search.nudges > 0) nudge<Format>(plane, search.nudges, best);
  return best;
}

}  // namespace billow::compiler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // per-target guard
