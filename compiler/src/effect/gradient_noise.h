// Noise of slopes at integer points, from the hashes of noise.h.
#ifndef BILLOW_COMPILER_EFFECT_GRADIENT_NOISE_H
#define BILLOW_COMPILER_EFFECT_GRADIENT_NOISE_H

#include <array>
#include <cstdint>

namespace billow::compiler {

// The lattice cell of a point, whose coordinates an int holds, and where in it the point lies, each share in [0, 1).
struct Lattice {
  int at[3];
  double share[3];
};
Lattice latticeOf(const std::array<double, 3>& p);

// Perlin's noise (2002, "Improving Noise"), about [-1, 1]. Coordinates below 2^31 in magnitude.
double gradientNoise(const std::array<double, 3>& p, std::uint32_t seed);

// Quintic, so that slopes and curvatures meet.
inline double fade(double f) {
  return f * f * f * (f * (f * 6 - 15) + 10);
}

inline double mix(double a, double b, double share) {
  return a + (b - a) * share;
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_GRADIENT_NOISE_H
