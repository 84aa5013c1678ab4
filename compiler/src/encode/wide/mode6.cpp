// BC7's mode 6 for eight blocks at a time: one line through four channels, 16 steps, ends of seven bits and a p-bit.
#include "encode/wide/parts.h"

namespace billow::compiler::BILLOW_WIDE {
namespace {

constexpr float kLevels = 15.0f;

struct Ends {
  Wide first[4], second[4];  // by channel
};

// kWeighted: some voxels do not count.
template <bool kWeighted>
struct Planes {
  const WideBrick& brick;
  Wide count[4];  // by channel
  Wide total[4];

  explicit Planes(const WideBrick& wide) : brick(wide) {
    for (std::uint32_t c = 0; c < 4; ++c) {
      count[c] = all(kWeighted ? 0.0f : 16.0f);
      total[c] = all(0.0f);
      for (std::uint32_t i = 0; i < 16; ++i) {
        if constexpr (kWeighted) count[c] += load(wide.weight[c][i]);
        total[c] += weigh(value(c, i), c, i);
      }
    }
  }
  Wide value(std::uint32_t c, std::uint32_t i) const { return load(brick.value[c][i]); }
  Wide weigh(Wide quantity, std::uint32_t c, std::uint32_t i) const {
    if constexpr (kWeighted) {
      return quantity * load(brick.weight[c][i]);
    } else {
      return quantity;
    }
  }
};

// Numbers of the pairs of four channels, a channel with itself included.
constexpr std::uint32_t kPairs = 10;
constexpr std::uint32_t kPairOf[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};

Wide highestMagnitude(const Wide axis[4]) {
  Wide largest = all(0.0f);
  for (std::uint32_t c = 0; c < 4; ++c) largest = max(largest, max(axis[c], -axis[c]));
  return largest;
}

// Divides by the largest component; 1 in all channels where there is none.
void normalise(Wide axis[4]) {
  const Wide largest = highestMagnitude(axis);
  const WideInt hasAxis = largest > all(1e-12f);
  const Wide inverse = all(1.0f) / select(hasAxis, largest, all(1.0f));
  for (std::uint32_t c = 0; c < 4; ++c) axis[c] = select(hasAxis, axis[c] * inverse, all(1.0f));
}

// The dominant eigenvector of the covariance, by power iteration from the row of the largest variance.
void dominantAxis(const Wide covariance[kPairs], Wide axis[4]) {
  Wide largest = covariance[0];
  for (std::uint32_t d = 0; d < 4; ++d) axis[d] = covariance[d];
  for (std::uint32_t c = 1; c < 4; ++c) {
    const Wide variance = covariance[kPairOf[c][c]];
    const WideInt larger = variance > largest;
    largest = select(larger, variance, largest);
    for (std::uint32_t d = 0; d < 4; ++d) axis[d] = select(larger, covariance[kPairOf[c][d]], axis[d]);
  }
  for (int pass = 0; pass < 4; ++pass) {
    normalise(axis);
    Wide image[4];
    for (std::uint32_t c = 0; c < 4; ++c) {
      const std::uint32_t* pair = kPairOf[c];
      image[c] = (covariance[pair[0]] * axis[0] + covariance[pair[1]] * axis[1]) +
                 (covariance[pair[2]] * axis[2] + covariance[pair[3]] * axis[3]);
    }
    for (std::uint32_t c = 0; c < 4; ++c) axis[c] = image[c];
  }
  normalise(axis);
}

// Where texel i projects on a line, in units of the direction; 0 where it has no channel that counts.
template <bool kWeighted>
struct Projector {
  const Planes<kWeighted>& planes;
  const Wide* origin;
  const Wide* direction;
  Wide inverse;  // unless kWeighted, of the direction's squared length

  Projector(const Planes<kWeighted>& of, const Wide from[4], const Wide along[4])
      : planes(of), origin(from), direction(along), inverse(all(0.0f)) {
    if constexpr (!kWeighted) inverse = reciprocal(squares(0));
  }
  Wide operator()(std::uint32_t i) const {
    Wide along = all(0.0f);
    for (std::uint32_t c = 0; c < 4; ++c) {
      along += planes.weigh(direction[c], c, i) * (planes.value(c, i) - origin[c]);
    }
    if constexpr (kWeighted) return along * reciprocal(squares(i));
    return along * inverse;
  }
  Wide squares(std::uint32_t i) const {
    Wide sum = all(0.0f);
    for (std::uint32_t c = 0; c < 4; ++c) sum += planes.weigh(direction[c], c, i) * direction[c];
    return sum;
  }
  static Wide reciprocal(Wide squared) {
    const WideInt counts = squared > all(1e-6f);
    return select(counts, all(1.0f) / select(counts, squared, all(1.0f)), all(0.0f));
  }
};

// The principal axis through the texels, from the lowest to the highest of their projections.
template <bool kWeighted>
Ends principalEnds(const Planes<kWeighted>& planes) {
  Wide mean[4];
  for (std::uint32_t c = 0; c < 4; ++c) mean[c] = planes.total[c] / max(planes.count[c], all(1.0f));
  Wide covariance[kPairs];
  for (Wide& sum : covariance) sum = all(0.0f);
  for (std::uint32_t i = 0; i < 16; ++i) {
    Wide deviation[4];
    for (std::uint32_t c = 0; c < 4; ++c) deviation[c] = planes.weigh(planes.value(c, i) - mean[c], c, i);
    for (std::uint32_t c = 0; c < 4; ++c) {
      for (std::uint32_t d = c; d < 4; ++d) covariance[kPairOf[c][d]] += deviation[c] * deviation[d];
    }
  }
  Wide axis[4];
  dominantAxis(covariance, axis);
  const Projector<kWeighted> project(planes, mean, axis);
  Wide low = project(0);
  Wide high = low;
  for (std::uint32_t i = 1; i < 16; ++i) {
    const Wide position = project(i);
    low = min(low, position);
    high = max(high, position);
  }
  Ends ends;
  for (std::uint32_t c = 0; c < 4; ++c) {
    ends.first[c] = clamp(mean[c] + axis[c] * low, 0.0f, 255.0f);
    ends.second[c] = clamp(mean[c] + axis[c] * high, 0.0f, 255.0f);
  }
  return ends;
}

template <bool kWeighted>
void nearestSteps(const Planes<kWeighted>& planes, const Ends& ends, Wide steps[16]) {
  Wide direction[4];
  for (std::uint32_t c = 0; c < 4; ++c) direction[c] = ends.second[c] - ends.first[c];
  const Projector<kWeighted> project(planes, ends.first, direction);
  for (std::uint32_t i = 0; i < 16; ++i) steps[i] = round(clamp(project(i) * all(kLevels), 0.0f, kLevels));
}

// 64ths along the line at which the decoder puts a step.
Wide stepWeight(Wide step) {
  return round(step * all(64.0f / kLevels));
}

// What least squares needs of a channel's texels: sums of t, t^2 and t times value, with t in 64ths.
struct Moments {
  Wide t, tt, tv;
};

template <bool kWeighted>
Moments channelMoments(const Planes<kWeighted>& planes, const Wide weights[16], std::uint32_t c) {
  Moments moments = {all(0.0f), all(0.0f), all(0.0f)};
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Wide weighted = planes.weigh(weights[i], c, i);
    moments.t += weighted;
    moments.tt += weighted * weights[i];
    moments.tv += weighted * planes.value(c, i);
  }
  return moments;
}

// The ends that fit best where each texel keeps its step; those given in channels where that is undetermined.
template <bool kWeighted>
void leastSquares(const Planes<kWeighted>& planes, const Wide steps[16], Ends& ends) {
  Wide weights[16];
  for (std::uint32_t i = 0; i < 16; ++i) weights[i] = stepWeight(steps[i]);
  for (std::uint32_t c = 0; c < 4; ++c) {
    const Moments moments = channelMoments(planes, weights, c);
    const Wide t = moments.t * all(1.0f / 64.0f);
    const Wide tt = moments.tt * all(1.0f / 4096.0f);
    const Wide tv = moments.tv * all(1.0f / 64.0f);
    const Wide st = t - tt;
    const Wide ss = (planes.count[c] - t) - st;
    const Wide sv = planes.total[c] - tv;
    const Wide determinant = ss * tt - st * st;
    const WideInt solvable = determinant > all(1e-3f);
    const Wide inverse = all(1.0f) / select(solvable, determinant, all(1.0f));
    const Wide first = clamp((sv * tt - tv * st) * inverse, 0.0f, 255.0f);
    const Wide second = clamp((tv * ss - sv * st) * inverse, 0.0f, 255.0f);
    ends.first[c] = select(solvable, first, ends.first[c]);
    ends.second[c] = select(solvable, second, ends.second[c]);
  }
}

// Seven bits and the p-bit that leaves the end nearest to where it was; channels of no count have no say.
void quantise(const Wide end[4], const Wide count[4], Wide quantised[4]) {
  Wide even[4], odd[4];
  Wide evenError = all(0.0f), oddError = all(0.0f);
  for (std::uint32_t c = 0; c < 4; ++c) {
    even[c] = round(clamp(end[c] * all(0.5f), 0.0f, 127.0f)) * all(2.0f);
    odd[c] = round(clamp((end[c] - all(1.0f)) * all(0.5f), 0.0f, 127.0f)) * all(2.0f) + all(1.0f);
    evenError += (even[c] - end[c]) * (even[c] - end[c]) * count[c];
    oddError += (odd[c] - end[c]) * (odd[c] - end[c]) * count[c];
  }
  const WideInt isOdd = oddError < evenError;
  for (std::uint32_t c = 0; c < 4; ++c) quantised[c] = select(isOdd, odd[c], even[c]);
}

// The squared error of lines with integer ends as the decoder interpolates them.
template <bool kWeighted>
Wide lineErrors(const Planes<kWeighted>& planes, const Ends& ends, const Wide steps[16]) {
  Wide error = all(0.0f);
  Wide start[4], span[4];
  for (std::uint32_t c = 0; c < 4; ++c) {
    // Exact in floats: integers below 2^24 and a division by a power of two.
    start[c] = ends.first[c] + all(0.5f);
    span[c] = (ends.second[c] - ends.first[c]) * all(1.0f / 64.0f);
  }
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Wide weight = stepWeight(steps[i]);
    for (std::uint32_t c = 0; c < 4; ++c) {
      const Wide difference = truncate(start[c] + weight * span[c]) - planes.value(c, i);
      error += planes.weigh(difference * difference, c, i);
    }
  }
  return error;
}

struct Best {
  Ends ends;
  Wide steps[16];
  Wide error = all(1e30f);
};

void keepBetter(const Ends& ends, const Wide steps[16], Wide error, Best& best) {
  const WideInt better = error < best.error;
  for (std::uint32_t c = 0; c < 4; ++c) {
    best.ends.first[c] = select(better, ends.first[c], best.ends.first[c]);
    best.ends.second[c] = select(better, ends.second[c], best.ends.second[c]);
  }
  for (std::uint32_t i = 0; i < 16; ++i) best.steps[i] = select(better, steps[i], best.steps[i]);
  best.error = select(better, error, best.error);
}

template <bool kWeighted>
Best fitLines(const Planes<kWeighted>& planes, int passes) {
  Best best;
  Ends ends = principalEnds(planes);
  Wide steps[16];
  nearestSteps(planes, ends, steps);
  for (std::uint32_t c = 0; c < 4; ++c) best.ends.first[c] = best.ends.second[c] = all(0.0f);
  for (std::uint32_t i = 0; i < 16; ++i) best.steps[i] = steps[i];
  for (int pass = 0; pass < passes; ++pass) {
    leastSquares(planes, best.steps, ends);
    Ends stored;
    quantise(ends.first, planes.count, stored.first);
    quantise(ends.second, planes.count, stored.second);
    nearestSteps(planes, stored, steps);
    keepBetter(stored, steps, lineErrors(planes, stored, steps), best);
  }
  return best;
}

}  // namespace

float fitMode6(const WideBrick& wide, int passes, WideMode6& fit) {
  const Best best = wide.allActive ? fitLines(Planes<false>(wide), passes) : fitLines(Planes<true>(wide), passes);
  for (std::uint32_t c = 0; c < 4; ++c) {
    store(best.ends.first[c], fit.first[c]);
    store(best.ends.second[c], fit.second[c]);
  }
  for (std::uint32_t i = 0; i < 16; ++i) store(best.steps[i], fit.step[i]);
  store(best.error, fit.error);
  return sum(best.error);
}

}  // namespace billow::compiler::BILLOW_WIDE
