// Hashes of integers and the noise made from them: what particles' random numbers, displacement maps and erosion come
// from. Shared by C++ and GLSL; spec/effects.md is the standard.
#ifndef BILLOW_FORMAT_NOISE_H
#define BILLOW_FORMAT_NOISE_H

#ifdef __cplusplus
#include <cmath>
#include <cstdint>
#define BILLOW_N_U32 std::uint32_t
#define BILLOW_N_FUNCTION inline
namespace billow::format {
using std::floor;
#else
#define BILLOW_N_U32 uint
#define BILLOW_N_FUNCTION
#endif

// Chris Wellons' lowbias32 (nullprogram.com/blog/2018/07/31), a bijection.
BILLOW_N_FUNCTION BILLOW_N_U32 hashInteger(BILLOW_N_U32 x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}

// The upper 24 bits as a number in [0, 1).
BILLOW_N_FUNCTION float unitOf(BILLOW_N_U32 hash) {
  return float(hash >> 8) * (1.0f / 16777216.0f);
}

// Of a point with integer coordinates.
BILLOW_N_FUNCTION BILLOW_N_U32 hashPoint(int x, int y, int z, BILLOW_N_U32 seed) {
  return hashInteger(hashInteger(hashInteger(BILLOW_N_U32(x) + seed) + BILLOW_N_U32(y)) + BILLOW_N_U32(z));
}

BILLOW_N_FUNCTION float smoothShare(float f) {
  return f * f * (3.0f - 2.0f * f);
}

// Random values at integer points, between them linear in smoothed shares; in [0, 1). |x|, |y|, |z| < 2^30.
BILLOW_N_FUNCTION float valueNoise(float x, float y, float z, BILLOW_N_U32 seed) {
  float fx = floor(x), fy = floor(y), fz = floor(z);
  int ix = int(fx), iy = int(fy), iz = int(fz);
  float sx = smoothShare(x - fx), sy = smoothShare(y - fy), sz = smoothShare(z - fz);
  float rows[4];
  for (int i = 0; i < 4; ++i) {
    int jy = iy + (i & 1), jz = iz + (i >> 1);
    float a = unitOf(hashPoint(ix, jy, jz, seed)), b = unitOf(hashPoint(ix + 1, jy, jz, seed));
    rows[i] = a + (b - a) * sx;
  }
  float low = rows[0] + (rows[1] - rows[0]) * sy, high = rows[2] + (rows[3] - rows[2]) * sy;
  return low + (high - low) * sz;
}

// The noise that erodes particles: three octaves of values, in [0, 1).
BILLOW_N_FUNCTION float erosionNoise(float x, float y, float z, BILLOW_N_U32 seed) {
  float sum = 4.0f * valueNoise(x, y, z, seed) + 2.0f * valueNoise(2.0f * x, 2.0f * y, 2.0f * z, seed + 1u);
  return (sum + valueNoise(4.0f * x, 4.0f * y, 4.0f * z, seed + 2u)) * (1.0f / 7.0f);
}

#ifdef __cplusplus
}  // namespace billow::format
#endif

#endif  // BILLOW_FORMAT_NOISE_H
