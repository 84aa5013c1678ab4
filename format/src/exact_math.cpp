#include "billow/format/exact_math.h"

#include <cmath>
#include <cstdint>
#include <numbers>

namespace billow::format {
namespace {

// ln 2 in two parts; the product of the first with a number below 2^11 is exact.
constexpr double kLn2High = 6.93147180369123816490e-01;
constexpr double kLn2Low = 1.90821492927058770002e-10;
constexpr double kLargest = 708;
// Below it the closed forms of the means cancel; their series are used instead.
constexpr double kSeriesBelow = 0.5;
constexpr int kTerms = 18;

}  // namespace

double decay(double x) {
  if (!(x < kLargest)) return 0;
  const double n = std::floor(x * std::numbers::log2e + 0.5);
  const double r = (x - n * kLn2High) - n * kLn2Low;
  double sum = 1;
  for (int i = kTerms; i > 0; --i) sum = 1 - sum * r / i;
  return std::ldexp(sum, -static_cast<int>(n));
}

// Sum of (-x)^i / (i + 1)!.
double decayMean(double x) {
  if (x >= kSeriesBelow) return (1 - decay(x)) / x;
  double sum = 1;
  for (int i = kTerms; i > 0; --i) sum = 1 - sum * x / (i + 1);
  return sum;
}

// Sum of (-x)^i / (i + 2)!.
double decayMeanSlope(double x) {
  if (x >= kSeriesBelow) return (1 - decayMean(x)) / x;
  double sum = 1;
  for (int i = kTerms; i > 0; --i) sum = 1 - sum * x / (i + 2);
  return sum / 2;
}

SineCosine sineCosine(double turns) {
  const double quarters = std::floor(turns * 4 + 0.5);
  const double angle = (turns - quarters / 4) * (2 * std::numbers::pi);  // within an eighth of a turn
  const double square = angle * angle;
  double sine = 1, cosine = 1;
  for (int i = kTerms; i > 0; i -= 2) {
    sine = 1 - sine * square / (i * (i + 1));
    cosine = 1 - cosine * square / (i * (i - 1));
  }
  sine *= angle;
  switch (static_cast<std::int64_t>(quarters) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

// From a guess that is off by less than a tenth of a radian; each step leaves about a sixth of the error's cube.
double turnsOf(double sine, double cosine) {
  const double length = std::sqrt(sine * sine + cosine * cosine);
  if (!(length > 0)) return 0;
  const double s = sine / length, c = cosine / length;
  const bool steep = std::abs(s) > std::abs(c);
  const double share = (steep ? std::abs(c) / std::abs(s) : std::abs(s) / std::abs(c)) / 8;
  const double octant = steep ? 0.25 - share : share;
  const double half = c < 0 ? 0.5 - octant : octant;
  double turns = s < 0 ? -half : half;
  for (int i = 0; i < 4; ++i) {
    const SineCosine at = sineCosine(turns);
    turns += (s * at.cosine - c * at.sine) / (2 * std::numbers::pi);
  }
  return turns;
}

// Newton's steps fall from 1 to the root; the smallest x, 2^-72, is near after 41.
double cubeRoot(double x) {
  if (!(x > 0)) return 0;
  double root = 1;
  for (int i = 0; i < 48; ++i) root = (2 * root + x / (root * root)) / 3;
  return root;
}

}  // namespace billow::format
