// Mode 7: two lines, each for one half of a partition of the texels, four steps, ends of five bits and a p-bit.
#include <array>

#include "billow/format/bc7_tables.h"
#include "encode/bc7_lines.h"

namespace billow::compiler {
namespace {

constexpr float kLevels = 3.0f;
constexpr std::uint32_t kPartitions = 64;

constexpr std::uint32_t kPairs = 10;  // of four channels, a channel with itself included
constexpr std::uint32_t kPairOf[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};

// Sums over a set of texels, from which the residual about the best line follows.
struct Moments {
  Float4 part[6] = {splat(0), splat(0), splat(0), splat(0), splat(0), splat(0)};  // products by channel, sums, counts

  Moments operator+(const Moments& other) const {
    Moments both;
    for (int i = 0; i < 6; ++i) both.part[i] = part[i] + other.part[i];
    return both;
  }
};

// The same for four sets at a time, one a lane.
struct LaneMoments {
  Float4 product[kPairs];
  Float4 total[4];
  Float4 count[4];

  LaneMoments(const Moments& a, const Moments& b, const Moments& c, const Moments& d) {
    const auto gather = [&](int part, int lane) {
      return Float4{a.part[part][lane], b.part[part][lane], c.part[part][lane], d.part[part][lane]};
    };
    for (int i = 0; i < 4; ++i) {
      for (int j = i; j < 4; ++j) product[kPairOf[i][j]] = gather(i, j);
      total[i] = gather(4, i);
      count[i] = gather(5, i);
    }
  }
  LaneMoments operator-(const LaneMoments& other) const {
    LaneMoments rest = *this;
    for (std::uint32_t i = 0; i < kPairs; ++i) rest.product[i] -= other.product[i];
    for (int c = 0; c < 4; ++c) {
      rest.total[c] -= other.total[c];
      rest.count[c] -= other.count[c];
    }
    return rest;
  }
};

Moments texelMoments(const Plane& plane, std::uint32_t texel) {
  Float4 deviation, count;
  for (std::uint32_t c = 0; c < 4; ++c) {
    count[c] = plane.weight[c][texel >> 2][texel & 3];
    deviation[c] = (plane.value[c][texel >> 2][texel & 3] - 127.5f) * count[c];
  }
  Moments moments;
  for (std::uint32_t c = 0; c < 4; ++c) moments.part[c] = deviation * splat(deviation[c]);
  moments.part[4] = deviation;
  moments.part[5] = count;
  return moments;
}

// About what remains of the squared deviations once the best line is taken out: trace less the largest eigenvalue, by
// one step of power iteration. Good for ranking only.
Float4 residual(const LaneMoments& moments) {
  Float4 covariance[kPairs];
  for (int i = 0; i < 4; ++i) {
    const Float4 mean = moments.total[i] / max(moments.count[i], splat(1.0f));
    for (int j = i; j < 4; ++j) {
      covariance[kPairOf[i][j]] = moments.product[kPairOf[i][j]] - moments.total[j] * mean;
    }
  }
  Float4 axis[4] = {covariance[0], covariance[1], covariance[2], covariance[3]};
  Float4 largest = covariance[0];
  Float4 trace = covariance[0];
  for (int c = 1; c < 4; ++c) {
    const Float4 variance = covariance[kPairOf[c][c]];
    const Int4 larger = variance > largest;
    largest = select(larger, variance, largest);
    for (int d = 0; d < 4; ++d) axis[d] = select(larger, covariance[kPairOf[c][d]], axis[d]);
    trace += variance;
  }
  Float4 squares = splat(0);
  Float4 along = splat(0);
  for (int c = 0; c < 4; ++c) {
    const std::uint32_t* row = kPairOf[c];
    const Float4 image = (covariance[row[0]] * axis[0] + covariance[row[1]] * axis[1]) +
                         (covariance[row[2]] * axis[2] + covariance[row[3]] * axis[3]);
    squares += axis[c] * axis[c];
    along += image * axis[c];
  }
  const Int4 hasAxis = squares > splat(1e-6f);
  return trace - select(hasAxis, along / select(hasAxis, squares, splat(1.0f)), splat(0));
}

// The moments of every set of texels within each row of four.
using RowMoments = std::array<std::array<Moments, 16>, 4>;

void sumRows(const Plane& plane, RowMoments& rows) {
  for (std::uint32_t r = 0; r < 4; ++r) {
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t bit = 1u << i;
      const Moments texel = texelMoments(plane, 4 * r + i);
      for (std::uint32_t set = 0; set < bit; ++set) rows[r][set | bit] = rows[r][set] + texel;
    }
  }
}

// Of the first `count` partitions; the others are out of the question.
std::array<float, kPartitions> rankPartitions(const Plane& plane, std::uint32_t count) {
  RowMoments rows;
  sumRows(plane, rows);
  const auto moments = [&](std::uint32_t texels) {
    return (rows[0][texels & 15] + rows[1][texels >> 4 & 15]) + (rows[2][texels >> 8 & 15] + rows[3][texels >> 12]);
  };
  const Moments whole = moments(0xffff);
  const LaneMoments all(whole, whole, whole, whole);
  std::array<float, kPartitions> residuals;
  residuals.fill(1e30f);
  for (std::uint32_t p = 0; p < count; p += 4) {
    const std::uint16_t* texels = format::kBc7Partitions2 + p;
    const LaneMoments second(moments(texels[0]), moments(texels[1]), moments(texels[2]), moments(texels[3]));
    const Float4 both = residual(second) + residual(all - second);
    for (std::uint32_t lane = 0; lane < 4; ++lane) residuals[p + lane] = both[lane];
  }
  return residuals;
}

Plane subsetPlane(const Plane& plane, std::uint32_t texels) {
  Plane subset = plane;
  for (std::uint32_t r = 0; r < 4; ++r) {
    Float4 mask;
    for (std::uint32_t i = 0; i < 4; ++i) mask[i] = static_cast<float>(texels >> (4 * r + i) & 1u);
    for (std::uint32_t c = 0; c < 4; ++c) subset.weight[c][r] = plane.weight[c][r] * mask;
  }
  return subset;
}

void tryPartition(const Plane& plane, std::uint32_t partition, const Bc7Search& search, Bc7Fit& best) {
  const std::uint32_t texels = format::kBc7Partitions2[partition];
  const LineFit first = fitLineWithP<6>(subsetPlane(plane, ~texels & 0xffffu), kLevels, search);
  if (!(first.error < best.error)) return;
  const LineFit second = fitLineWithP<6>(subsetPlane(plane, texels), kLevels, search);
  const float error = first.error + second.error;
  if (!(error < best.error)) return;
  best.mode = 7;
  best.partition = partition;
  best.rotation = 0;
  best.colorIsSecond = false;
  best.line[0] = first.line;
  best.line[1] = second.line;
  for (std::uint32_t i = 0; i < 16; ++i) {
    const Steps& from = (texels >> i & 1u) != 0 ? second.steps : first.steps;
    best.steps.step[i >> 2][i & 3] = from.step[i >> 2][i & 3];
  }
  best.error = error;
}

}  // namespace

void tryMode7(const Plane& plane, const Bc7Search& search, Bc7Fit& best) {
  std::array<float, kPartitions> residuals = rankPartitions(plane, static_cast<std::uint32_t>(search.ranked));
  for (int n = 0; n < search.partitions; ++n) {
    std::uint32_t next = 0;
    for (std::uint32_t p = 1; p < kPartitions; ++p) {
      if (residuals[p] < residuals[next]) next = p;
    }
    // The steps between cannot gain back what the lines leave.
    if (!(residuals[next] < best.error)) return;
    tryPartition(plane, next, search, best);
    residuals[next] = 1e30f;
  }
}

}  // namespace billow::compiler
