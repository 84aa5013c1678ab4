// Rounding the ends of a line to what a BC7 mode can store, expanded to eight bits again.
#ifndef BILLOW_COMPILER_ENCODE_BC7_ENDS_H
#define BILLOW_COMPILER_ENCODE_BC7_ENDS_H

#include "encode/bc7_plane.h"

namespace billow::compiler {

// Repeats the high bits of a Bits-wide integer below it, to fill eight.
template <int Bits>
Float4 expandBits(Float4 value) {
  if constexpr (Bits == 8) {
    return value;
  } else {
    constexpr float kUp = 1 << (8 - Bits);
    constexpr float kDown = 1.0f / static_cast<float>(1 << (2 * Bits - 8));
    return value * splat(kUp) + truncate(value * splat(kDown));
  }
}

// The nearest of what Bits bits can say. `end` in [0, 255].
template <int Bits>
Float4 quantiseEnd(Float4 end) {
  constexpr float kScale = static_cast<float>((1 << Bits) - 1) / 255.0f;
  return expandBits<Bits>(round(end * splat(kScale)));
}

// The same where the lowest of the Bits bits is `pBit` (0 or 1) in all channels.
template <int Bits>
Float4 quantiseEndWithP(Float4 end, float pBit) {
  constexpr float kScale = static_cast<float>((1 << Bits) - 1) / 255.0f;
  constexpr float kHighest = (1 << (Bits - 1)) - 1;
  const Float4 half = clamp((end * splat(kScale) - splat(pBit)) * splat(0.5f), 0.0f, kHighest);
  return expandBits<Bits>(round(half) * splat(2.0f) + splat(pBit));
}

// The p-bit that leaves the end nearest to where it was; channels of no `count` have no say.
template <int Bits>
Float4 quantiseEndWithBestP(Float4 end, Float4 count) {
  const Float4 even = quantiseEndWithP<Bits>(end, 0.0f);
  const Float4 odd = quantiseEndWithP<Bits>(end, 1.0f);
  const Float4 evenError = (even - end) * (even - end) * count;
  const Float4 oddError = (odd - end) * (odd - end) * count;
  return sum(oddError) < sum(evenError) ? odd : even;
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_BC7_ENDS_H
