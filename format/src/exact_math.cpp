#include "billow/format/exact_math.h"

#include <array>
#include <cmath>
#include <cstddef>
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
constexpr int kTerms = 16;  // of series for arguments below 0.8: what is left is below a last bit

// Quotients are slow, so they are taken when compiling: 1 / (n + shift), and 1 / (n (n + 1)).
constexpr std::array<double, kTerms + 3> reciprocals() {
  std::array<double, kTerms + 3> values{};
  for (int n = 1; n < kTerms + 3; ++n) values[static_cast<std::size_t>(n)] = 1.0 / n;
  return values;
}
constexpr std::array<double, kTerms + 2> pairReciprocals() {
  std::array<double, kTerms + 2> values{};
  for (int n = 1; n < kTerms + 2; ++n) values[static_cast<std::size_t>(n)] = 1.0 / (n * (n + 1));
  return values;
}
constexpr auto kOver = reciprocals();
constexpr auto kOverPair = pairReciprocals();

// 1 - x / (1 + shift) + x^2 / ((1 + shift) (2 + shift)) - ...
double alternating(double x, std::size_t shift) {
  double sum = 1;
  for (std::size_t n = kTerms; n > 0; --n) sum = 1 - sum * x * kOver[n + shift];
  return sum;
}

}  // namespace

double decay(double x) {
  if (!(x < kLargest)) return 0;
  const double n = std::floor(x * std::numbers::log2e + 0.5);
  const double r = (x - n * kLn2High) - n * kLn2Low;
  return std::ldexp(alternating(r, 0), -static_cast<int>(n));
}

double decayMean(double x) {
  return x < kSeriesBelow ? alternating(x, 1) : (1 - decay(x)) / x;
}

double decayMeanSlope(double x) {
  return x < kSeriesBelow ? alternating(x, 2) / 2 : (1 - decayMean(x)) / x;
}

SineCosine sineCosine(double turns) {
  const double quarters = std::floor(turns * 4 + 0.5);
  const double angle = (turns - quarters / 4) * (2 * std::numbers::pi);  // within an eighth of a turn
  const double square = angle * angle;
  double sine = 1, cosine = 1;
  for (std::size_t n = kTerms; n > 0; n -= 2) {
    sine = 1 - sine * square * kOverPair[n];
    cosine = 1 - cosine * square * kOverPair[n - 1];
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

// Newton's steps from a line through the ends of [1/8, 1], which is off by a tenth at most.
double cubeRoot(double x) {
  if (!(x > 0)) return 0;
  double scale = 1;
  while (x < 0.125) {
    x *= 8;
    scale /= 2;
  }
  double root = (3 + 4 * x) / 7;
  for (int i = 0; i < 5; ++i) root -= (root - x / (root * root)) / 3;
  return root * scale;
}

}  // namespace billow::format
