// The colour of heat.
#ifndef BILLOW_COMPILER_EFFECT_BLACK_BODY_H
#define BILLOW_COMPILER_EFFECT_BLACK_BODY_H

#include <algorithm>
#include <array>

namespace billow::compiler {

// Radiance of a black body of 500 to 20000 kelvin in linear sRGB, no component below 0, in an arbitrary unit: Planck's
// law under the CIE 1931 colour matching functions, by Wyman, Sloan and Shirley, "Simple Analytic Approximations to the
// CIE XYZ Color Matching Functions" (JCGT 2013).
std::array<double, 3> blackBody(double kelvin);

inline double largest(const std::array<double, 3>& v) {
  return std::max({v[0], v[1], v[2]});
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_BLACK_BODY_H
