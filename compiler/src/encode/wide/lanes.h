// Eight floats at a time, one block a lane. Compiled once for every machine and once for AVX2, each in a namespace of
// its own, so that the linker never mixes the two. Every operation is a single IEEE one: both give the same bits.
#ifndef BILLOW_COMPILER_ENCODE_WIDE_LANES_H
#define BILLOW_COMPILER_ENCODE_WIDE_LANES_H

#include <cstdint>
#include <cstring>

#ifdef __AVX2__
#define BILLOW_WIDE avx2
#else
#define BILLOW_WIDE baseline
#endif

namespace billow::compiler::BILLOW_WIDE {

constexpr std::uint32_t kWideLanes = 8;

#ifdef __AVX2__

using Wide = float __attribute__((vector_size(32)));
using WideInt = std::int32_t __attribute__((vector_size(32)));

inline Wide select(WideInt condition, Wide yes, Wide no) {
  return condition ? yes : no;
}
// The integer part of values in [0, 2^31), as floats.
inline Wide truncate(Wide value) {
  return __builtin_convertvector(__builtin_convertvector(value, WideInt), Wide);
}

#else

// Two vectors of four: compilers take wider ones apart into single floats where the machine has none.
using Quarter = float __attribute__((vector_size(16)));
using QuarterInt = std::int32_t __attribute__((vector_size(16)));

struct Wide {
  Quarter low, high;
};
struct WideInt {
  QuarterInt low, high;
};

inline Wide operator+(Wide a, Wide b) {
  return {a.low + b.low, a.high + b.high};
}
inline Wide operator-(Wide a, Wide b) {
  return {a.low - b.low, a.high - b.high};
}
inline Wide operator*(Wide a, Wide b) {
  return {a.low * b.low, a.high * b.high};
}
inline Wide operator/(Wide a, Wide b) {
  return {a.low / b.low, a.high / b.high};
}
inline Wide operator-(Wide a) {
  return {-a.low, -a.high};
}
inline Wide& operator+=(Wide& a, Wide b) {
  return a = a + b;
}
inline WideInt operator<(Wide a, Wide b) {
  return {a.low < b.low, a.high < b.high};
}
inline WideInt operator>(Wide a, Wide b) {
  return b < a;
}
inline WideInt operator==(Wide a, Wide b) {
  return {a.low == b.low, a.high == b.high};
}
inline WideInt operator&(WideInt a, WideInt b) {
  return {a.low & b.low, a.high & b.high};
}
inline WideInt operator~(WideInt a) {
  return {~a.low, ~a.high};
}

inline Quarter selectQuarter(QuarterInt condition, Quarter yes, Quarter no) {
  return reinterpret_cast<Quarter>((condition & reinterpret_cast<QuarterInt>(yes)) |
                                   (~condition & reinterpret_cast<QuarterInt>(no)));
}
inline Wide select(WideInt condition, Wide yes, Wide no) {
  return {selectQuarter(condition.low, yes.low, no.low), selectQuarter(condition.high, yes.high, no.high)};
}
inline Quarter truncateQuarter(Quarter value) {
  return __builtin_convertvector(__builtin_convertvector(value, QuarterInt), Quarter);
}
// The integer part of values in [0, 2^31), as floats.
inline Wide truncate(Wide value) {
  return {truncateQuarter(value.low), truncateQuarter(value.high)};
}

#endif

inline Wide load(const float* from) {
  Wide value;
  std::memcpy(&value, from, sizeof value);
  return value;
}
inline void store(Wide value, float* to) {
  std::memcpy(to, &value, sizeof value);
}
inline Wide all(float value) {
#ifdef __AVX2__
  return Wide{value, value, value, value, value, value, value, value};
#else
  const Quarter quarter = {value, value, value, value};
  return {quarter, quarter};
#endif
}

inline Wide min(Wide a, Wide b) {
  return select(a < b, a, b);
}
inline Wide max(Wide a, Wide b) {
  return select(a > b, a, b);
}
inline Wide clamp(Wide value, float low, float high) {
  return min(max(value, all(low)), all(high));
}
// The nearest integer (halves upwards) of values in [0, 2^22].
inline Wide round(Wide value) {
  return truncate(value + all(0.5f));
}
inline bool any(WideInt condition) {
  std::int64_t parts[4];
  std::memcpy(parts, &condition, sizeof parts);
  return ((parts[0] | parts[1]) | (parts[2] | parts[3])) != 0;
}
inline float sum(Wide value) {
  float lane[kWideLanes];
  store(value, lane);
  return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
}

// Doubles by the machine's vector: kWideLanes of them are several.
#ifdef __AVX2__
constexpr std::uint32_t kDoubleLanes = 4;
#else
constexpr std::uint32_t kDoubleLanes = 2;
#endif
using Doubles = double __attribute__((vector_size(8 * kDoubleLanes)));
using Longs = std::int64_t __attribute__((vector_size(8 * kDoubleLanes)));

inline Doubles loadDoubles(const float* from) {
  using Floats = float __attribute__((vector_size(4 * kDoubleLanes)));
  Floats value;
  std::memcpy(&value, from, sizeof value);
  return __builtin_convertvector(value, Doubles);
}
inline Doubles select(Longs condition, Doubles yes, Doubles no) {
  return reinterpret_cast<Doubles>((condition & reinterpret_cast<Longs>(yes)) |
                                   (~condition & reinterpret_cast<Longs>(no)));
}
inline Doubles max(Doubles a, Doubles b) {
  return select(a > b, a, b);
}

}  // namespace billow::compiler::BILLOW_WIDE

#endif  // BILLOW_COMPILER_ENCODE_WIDE_LANES_H
