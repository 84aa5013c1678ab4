// Four floats at a time, in the vector extension that gcc and clang share. Every operation is a single IEEE one and
// sums are taken in a fixed order, so that all builds agree to the bit.
#ifndef BILLOW_COMPILER_ENCODE_LANES_H
#define BILLOW_COMPILER_ENCODE_LANES_H

#include <cstdint>
#include <cstring>

namespace billow::compiler {

using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));

inline Float4 splat(float value) {
  return Float4{value, value, value, value};
}

inline Float4 select(Int4 condition, Float4 yes, Float4 no) {
  return reinterpret_cast<Float4>((condition & reinterpret_cast<Int4>(yes)) |
                                  (~condition & reinterpret_cast<Int4>(no)));
}
inline Float4 min(Float4 a, Float4 b) {
  return select(a < b, a, b);
}
inline Float4 max(Float4 a, Float4 b) {
  return select(a > b, a, b);
}
inline Float4 clamp(Float4 value, float low, float high) {
  return min(max(value, splat(low)), splat(high));
}

// The integer part of values in [0, 2^31), as floats.
inline Float4 truncate(Float4 value) {
  return __builtin_convertvector(__builtin_convertvector(value, Int4), Float4);
}
// The nearest integer (halves upwards) of values in [0, 2^22].
inline Float4 round(Float4 value) {
  return truncate(value + splat(0.5f));
}

inline float sum(Float4 v) {
  return (v[0] + v[2]) + (v[1] + v[3]);
}

// The sums of four vectors, one a lane.
inline Float4 sums(Float4 a, Float4 b, Float4 c, Float4 d) {
  const Float4 lane0 = {a[0], b[0], c[0], d[0]};
  const Float4 lane1 = {a[1], b[1], c[1], d[1]};
  const Float4 lane2 = {a[2], b[2], c[2], d[2]};
  const Float4 lane3 = {a[3], b[3], c[3], d[3]};
  return (lane0 + lane2) + (lane1 + lane3);
}

inline float lowest(Float4 v) {
  const float a = v[0] < v[1] ? v[0] : v[1];
  const float b = v[2] < v[3] ? v[2] : v[3];
  return a < b ? a : b;
}
inline float highest(Float4 v) {
  const float a = v[0] > v[1] ? v[0] : v[1];
  const float b = v[2] > v[3] ? v[2] : v[3];
  return a > b ? a : b;
}

inline Float4 load(const float* from) {
  Float4 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_LANES_H
