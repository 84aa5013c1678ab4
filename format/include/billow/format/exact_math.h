// Functions whose results have the same bits on every machine: made of additions, multiplications, divisions, floor and
// square roots, which IEEE 754 rounds alike everywhere, where a C library's exp, sin and cbrt may differ.
#ifndef BILLOW_FORMAT_EXACT_MATH_H
#define BILLOW_FORMAT_EXACT_MATH_H

namespace billow::format {

// e^-x for x >= 0, to a relative error of 1e-15; 0 beyond 708.
double decay(double x);
// (1 - e^-x) / x, 1 at 0, for x >= 0: the mean of e^-y over y in [0, x].
double decayMean(double x);
// (x - 1 + e^-x) / x^2, 1/2 at 0, for x >= 0.
double decayMeanSlope(double x);

struct SineCosine {
  double sine, cosine;
};
// Of an angle in turns (1 is the full circle), |turns| < 2^50.
SineCosine sineCosine(double turns);

// The angle in turns, in [-1/2, 1/2], whose sine and cosine are in the ratio of these two; 0 where both are 0.
double turnsOf(double sine, double cosine);

// x^(1/3) for x in [0, 1], to 1e-12.
double cubeRoot(double x);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_EXACT_MATH_H
