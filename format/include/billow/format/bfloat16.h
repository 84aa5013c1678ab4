// bfloat16: the upper half of a single-precision number.
#ifndef BILLOW_FORMAT_BFLOAT16_H
#define BILLOW_FORMAT_BFLOAT16_H

#include <bit>
#include <cstdint>

namespace billow::format {

// The nearest bfloat16, ties to even; infinity where `value`, not a NaN, is nearer to it than to the largest one.
constexpr std::uint16_t toBfloat16(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return static_cast<std::uint16_t>((bits + 0x7fff + (bits >> 16 & 1)) >> 16);
}

constexpr float fromBfloat16(std::uint16_t bits) {
  return std::bit_cast<float>(std::uint32_t{bits} << 16);
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_BFLOAT16_H
