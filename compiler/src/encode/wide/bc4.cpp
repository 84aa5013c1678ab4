// BC4 blocks, eight at a time: two 8-bit ends and 3-bit steps between them.
#include "encode/wide/parts.h"

namespace billow::compiler::BILLOW_WIDE {
namespace {

// Ends as they will be stored: with eight steps where first > second, else with six and the constants 0 and 255.
struct Fit {
  Wide first, second;
  Wide error;
};

struct Range {
  Wide low, high;
};

// Eight blocks of 16 texels. kWeighted: some do not count.
template <bool kWeighted>
struct Blocks {
  const float (*values)[8];
  const float (*weights)[8];

  Wide value(std::uint32_t i) const { return load(values[i]); }
  Wide weigh(Wide quantity, std::uint32_t i) const {
    if constexpr (kWeighted) {
      return quantity * load(weights[i]);
    } else {
      return quantity;
    }
  }
};

Wide toByte(Wide value) {
  return round(clamp(value, 0.0f, 255.0f));
}

// Of texels with weight and strictly between `above` and `below`; both 0 where there is none.
template <bool kWeighted>
Range rangeOf(const Blocks<kWeighted>& blocks, float above, float below) {
  Range range = {all(1e30f), all(-1e30f)};
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Wide value = blocks.value(i);
    WideInt counts = (value > all(above)) & (value < all(below));
    if constexpr (kWeighted) counts = counts & (load(blocks.weights[i]) > all(0.0f));
    range.low = min(range.low, select(counts, value, all(1e30f)));
    range.high = max(range.high, select(counts, value, all(-1e30f)));
  }
  const WideInt none = range.low > range.high;
  return {select(none, all(0.0f), range.low), select(none, all(0.0f), range.high)};
}

// The step of [0, levels] nearest to a value, where `scale` is levels / (second - first).
Wide stepOf(Wide value, Wide first, Wide scale, float levels) {
  return round(clamp((value - first) * scale, 0.0f, levels));
}

// What is decoded `step` of `levels` (7 or 5) from first to second: rounded to the nearest integer.
Wide decoded(Wide first, Wide second, Wide step, float levels) {
  return round((first * (all(levels) - step) + second * step) * all(1.0f / levels));
}

void keepBetter(Wide first, Wide second, Wide error, Fit& best) {
  const WideInt better = error < best.error;
  best.first = select(better, first, best.first);
  best.second = select(better, second, best.second);
  best.error = select(better, error, best.error);
}

template <bool kWeighted>
void tryEightSteps(const Blocks<kWeighted>& blocks, Range range, Fit& best) {
  const Wide a = toByte(range.low);
  const Wide b = toByte(range.high);
  Wide second = min(a, b);
  Wide first = max(a, b);
  // Equal ends would mean six steps.
  const WideInt equal = first == second;
  const WideInt roomAbove = first < all(255.0f);
  first = first + select(equal & roomAbove, all(1.0f), all(0.0f));
  second = second - select(equal & ~roomAbove, all(1.0f), all(0.0f));
  const Wide scale = all(7.0f) / (second - first);
  Wide error = all(0.0f);
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Wide value = blocks.value(i);
    const Wide difference = decoded(first, second, stepOf(value, first, scale, 7.0f), 7.0f) - value;
    error += blocks.weigh(difference * difference, i);
  }
  keepBetter(first, second, error, best);
}

Wide sixScale(Wide first, Wide second) {
  const Wide length = second - first;
  return select(length > all(0.0f), all(5.0f) / length, all(0.0f));
}

template <bool kWeighted>
void trySixSteps(const Blocks<kWeighted>& blocks, Range range, Fit& best) {
  const Wide first = toByte(range.low);
  const Wide second = max(toByte(range.high), first);
  const Wide scale = sixScale(first, second);
  Wide error = all(0.0f);
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Wide value = blocks.value(i);
    const Wide between = decoded(first, second, stepOf(value, first, scale, 5.0f), 5.0f) - value;
    const Wide fromTop = all(255.0f) - value;
    error += blocks.weigh(min(between * between, min(value * value, fromTop * fromTop)), i);
  }
  keepBetter(first, second, error, best);
}

// The ends that fit best where every value keeps its step of eight between the ends it has; those where undetermined.
// Weighted linear regression in step k of 7: with t = k / 7 and s = 1 - t the sums of s^2, st and t^2 follow from the
// sums of 1, k and k^2.
template <bool kWeighted>
Range leastSquares(const Blocks<kWeighted>& blocks, Wide count, Wide total, Range ends) {
  const Wide length = ends.high - ends.low;
  const Wide scale = select(length > all(0.0f), all(7.0f) / length, all(0.0f));
  Wide sumK = all(0.0f), sumKK = all(0.0f), sumKV = all(0.0f);
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Wide value = blocks.value(i);
    const Wide step = stepOf(value, ends.low, scale, 7.0f);
    const Wide weighted = blocks.weigh(step, i);
    sumK += weighted;
    sumKK += weighted * step;
    sumKV += weighted * value;
  }
  const Wide sumT = sumK * all(1.0f / 7.0f);
  const Wide tt = sumKK * all(1.0f / 49.0f);
  const Wide st = sumT - tt;
  const Wide ss = (count - sumT) - st;
  const Wide tv = sumKV * all(1.0f / 7.0f);
  const Wide sv = total - tv;
  const Wide determinant = ss * tt - st * st;
  const WideInt solvable = determinant > all(1e-3f);
  const Wide inverse = all(1.0f) / select(solvable, determinant, all(1.0f));
  return {select(solvable, (sv * tt - tv * st) * inverse, ends.low),
          select(solvable, (tv * ss - sv * st) * inverse, ends.high)};
}

// Least squares from two starts, since it only finds the optimum nearest to each: the whole range, and one that leaves
// out the outermost values.
template <bool kWeighted>
void refineEightSteps(const Blocks<kWeighted>& blocks, Range range, Fit& best) {
  static constexpr float kInsets[] = {0.0f, 0.1f};
  Wide count = all(0.0f), total = all(0.0f);
  for (std::uint32_t i = 0; i < 16; ++i) {
    count += blocks.weigh(all(1.0f), i);
    total += blocks.weigh(blocks.value(i), i);
  }
  const Wide width = range.high - range.low;
  for (const float inset : kInsets) {
    Range ends = {range.low + all(inset) * width, range.high - all(inset) * width};
    for (int pass = 0; pass < 2; ++pass) {
      ends = leastSquares(blocks, count, total, ends);
      tryEightSteps(blocks, ends, best);
    }
  }
}

// Moves one end at a time by a texel or two.
template <bool kWeighted>
void nudgeEightSteps(const Blocks<kWeighted>& blocks, Fit& best) {
  static constexpr float kMoves[] = {-2.0f, -1.0f, 1.0f, 2.0f};
  const Fit before = best;
  const WideInt eight = best.first > best.second;
  if (!any(eight)) return;
  for (const float move : kMoves) {
    tryEightSteps(blocks, {best.second + all(move), best.first}, best);
    tryEightSteps(blocks, {best.second, best.first + all(move)}, best);
  }
  best.first = select(eight, best.first, before.first);
  best.second = select(eight, best.second, before.second);
}

template <bool kWeighted>
Fit fitBlocks(const Blocks<kWeighted>& blocks) {
  Fit best = {all(0.0f), all(0.0f), all(1e30f)};
  const Range range = rangeOf(blocks, -1.0f, 256.0f);
  trySixSteps(blocks, range, best);
  if (!any(best.error > all(0.0f))) return best;
  tryEightSteps(blocks, range, best);
  // The six steps need not reach what the constants serve.
  if (any(range.low < all(1.0f)) || any(range.high > all(254.0f))) {
    trySixSteps(blocks, rangeOf(blocks, 1.0f, 254.0f), best);
  }
  refineEightSteps(blocks, range, best);
  nudgeEightSteps(blocks, best);
  return best;
}

// Where a value's step stands in the palette: the ends come first.
Wide paletteNumber(Wide value, const Fit& fit) {
  const Wide step8 = stepOf(value, fit.first, all(7.0f) / (fit.second - fit.first), 7.0f);
  const Wide number8 = select(step8 == all(0.0f), all(0.0f), select(step8 == all(7.0f), all(1.0f), step8 + all(1.0f)));
  const Wide step6 = stepOf(value, fit.first, sixScale(fit.first, fit.second), 5.0f);
  const Wide number6 = select(step6 == all(0.0f), all(0.0f), select(step6 == all(5.0f), all(1.0f), step6 + all(1.0f)));
  const Wide between = decoded(fit.first, fit.second, step6, 5.0f) - value;
  const Wide fromTop = all(255.0f) - value;
  const Wide squared = between * between;
  const Wide bottomSquared = value * value;
  const Wide topSquared = fromTop * fromTop;
  Wide number = select(bottomSquared < min(squared, topSquared), all(6.0f), number6);
  number = select(topSquared < min(squared, bottomSquared), all(7.0f), number);
  return select(fit.first > fit.second, number8, number);
}

// Writes the eight blocks of channel c of a WideBrick.
void storeBlocks(const float (*values)[8], const Fit& fit, std::uint32_t c, std::byte* payload) {
  // Eight 3-bit numbers are exact in a float: two halves of eight texels each.
  Wide half[2] = {all(0.0f), all(0.0f)};
  for (std::uint32_t i = 16; i-- > 0;) {
    half[i >> 3] = half[i >> 3] * all(8.0f) + paletteNumber(load(values[i]), fit);
  }
  float first[8], second[8], low[8], high[8];
  store(fit.first, first);
  store(fit.second, second);
  store(half[0], low);
  store(half[1], high);
  for (std::uint32_t lane = 0; lane < kWideLanes; ++lane) {
    const std::uint64_t bits = static_cast<std::uint64_t>(first[lane]) | static_cast<std::uint64_t>(second[lane]) << 8 |
                               static_cast<std::uint64_t>(low[lane]) << 16 |
                               static_cast<std::uint64_t>(high[lane]) << 40;
    std::byte* block = payload + 8 * (((lane >> 2) * 4 + c) * 4 + (lane & 3));
    for (std::uint32_t i = 0; i < 8; ++i) block[i] = static_cast<std::byte>(bits >> (8 * i) & 0xff);
  }
}

}  // namespace

float bc4Spread(const WideBrick& wide) {
  Wide total = all(0.0f);
  for (std::uint32_t c = 0; c < 4; ++c) {
    const Range range = wide.allActive ? rangeOf(Blocks<false>{wide.value[c], wide.weight[c]}, -1.0f, 256.0f)
                                       : rangeOf(Blocks<true>{wide.value[c], wide.weight[c]}, -1.0f, 256.0f);
    total += (range.high - range.low) * (range.high - range.low);
  }
  return sum(total);
}

void encodeBc4(const WideBrick& wide, std::byte* payload) {
  for (std::uint32_t c = 0; c < 4; ++c) {
    const Fit fit = wide.allActive ? fitBlocks(Blocks<false>{wide.value[c], wide.weight[c]})
                                   : fitBlocks(Blocks<true>{wide.value[c], wide.weight[c]});
    storeBlocks(wide.value[c], fit, c, payload);
  }
}

}  // namespace billow::compiler::BILLOW_WIDE
