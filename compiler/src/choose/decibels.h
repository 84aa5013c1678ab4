// Decibels to ratios by arithmetic that every machine does alike: what comes of them decides bytes, and a math
// library's pow() may differ in its last bit from one processor to the next.
#ifndef BILLOW_COMPILER_DECIBELS_H
#define BILLOW_COMPILER_DECIBELS_H

#include <algorithm>
#include <cmath>

namespace billow::compiler {

// 10^(decibels / 20), the ratio of amplitudes, within some 1e-15 of itself; 0 or infinite beyond a double's range.
inline double amplitudeRatio(double decibels) {
  constexpr double kOctavesPerDecibel = 0.16609640474436813;  // log2(10) / 20
  constexpr double kLn2 = 0.69314718055994531;
  const double octaves = std::clamp(decibels * kOctavesPerDecibel, -4096.0, 4096.0);
  const double whole = std::floor(octaves);
  const double x = (octaves - whole) * kLn2;
  // exp(x) by its series, x in [0, ln 2): the 20th term is below 1e-21.
  double sum = 1;
  for (int term = 20; term > 0; --term) sum = 1 + x * sum / term;
  return std::ldexp(sum, static_cast<int>(whole));
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_DECIBELS_H
