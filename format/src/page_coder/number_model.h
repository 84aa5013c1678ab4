// Models of numbers, made of those of symbols and bits: spec/pagecodec.md.
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_NUMBER_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_NUMBER_MODEL_H

#include <cstdlib>

#include "models.h"

namespace billow::format::page_coder {

// A byte as two symbols, the high one first, the low one in its context.
struct ByteModel {
  SymbolModel high = evenModel();
  std::array<SymbolModel, kSymbols> low = filled();

  template <class Coder>
  std::uint32_t code(Coder& coder, std::uint32_t value) {
    const std::uint32_t top = coder.symbol(high, value >> 4);
    return top << 4 | coder.symbol(low[top], value & 15);
  }

 private:
  static std::array<SymbolModel, kSymbols> filled() {
    std::array<SymbolModel, kSymbols> all;
    all.fill(evenModel());
    return all;
  }
};

// Signed differences in classes: 0, 1, 2, 3-4, 5-8, 9-16, 17-32, 33-64 in either direction; symbol 15 escapes.
inline constexpr std::uint32_t kEscape = 15;

// Of class c, magnitudes begin at kClassFirst[c] and have kClassBits[c] bits after it.
inline constexpr std::uint8_t kClassFirst[8] = {0, 1, 2, 3, 5, 9, 17, 33};
inline constexpr std::uint8_t kClassBits[8] = {0, 0, 0, 1, 2, 3, 4, 5};

inline std::uint32_t differenceSymbol(int difference) {
  const auto magnitude = static_cast<std::uint32_t>(std::abs(difference));
  if (magnitude == 0) return 0;
  const std::uint32_t width =
      magnitude <= 2 ? magnitude : static_cast<std::uint32_t>(std::bit_width(magnitude - 1)) + 1;
  if (width > 7) return kEscape;
  return 2 * width - (difference > 0);
}

// The bits within a class: the highest has a model, the others none.
struct ClassBits {
  std::array<BitModel, kSymbols> top = filled();

  template <class Coder>
  [[gnu::always_inline]] std::uint32_t code(Coder& coder, std::uint32_t symbol, std::uint32_t value) {
    const std::uint32_t count = kClassBits[(symbol + 1) / 2];
    if (count == 0) return 0;
    const std::uint32_t high = coder.bit(top[symbol], (value >> (count - 1)) != 0);
    return high << (count - 1) | coder.bits(count - 1, value & ((1u << (count - 1)) - 1));
  }

 private:
  static constexpr std::array<BitModel, kSymbols> filled() {
    std::array<BitModel, kSymbols> all{};
    all.fill(bitModel(kScale * 7 / 16));
    return all;
  }
};

// `value` in [0, 2^width) by its difference to `expected` in the same range.
template <class Coder>
[[gnu::always_inline]] inline std::uint32_t codeDifference(Coder& coder, SymbolModel& model, ClassBits& bits,
                                                           std::uint32_t width, std::uint32_t expected,
                                                           std::uint32_t value) {
  const int difference = static_cast<int>(value) - static_cast<int>(expected);
  const std::uint32_t symbol = coder.symbol(model, Coder::kDecodes ? 0 : differenceSymbol(difference));
  if (symbol == 0) return expected;
  if (symbol == kEscape) return coder.bits(width, value);
  const std::uint32_t first = kClassFirst[(symbol + 1) / 2];
  const std::uint32_t magnitude =
      first + bits.code(coder, symbol, static_cast<std::uint32_t>(std::abs(difference)) - first);
  return ((symbol & 1) != 0 ? expected + magnitude : expected - magnitude) & ((1u << width) - 1);
}

// Any 32-bit number: how many bits it has in the context of the last number's, then those below the highest.
struct NumberModel {
  std::array<SymbolModel, kSymbols> width = filled();
  std::uint32_t last = 0;

  template <class Coder>
  std::uint32_t code(Coder& coder, std::uint32_t value) {
    std::uint32_t bits = static_cast<std::uint32_t>(std::bit_width(value));
    const std::uint32_t symbol = coder.symbol(width[last], bits < kEscape ? bits : kEscape);
    last = symbol;
    if (symbol == kEscape) return coder.bits(32, value);
    if (symbol < 2) return symbol;
    return 1u << (symbol - 1) | coder.bits(symbol - 1, value & ((1u << (symbol - 1)) - 1));
  }

 private:
  static std::array<SymbolModel, kSymbols> filled() {
    std::array<SymbolModel, kSymbols> all;
    all.fill(evenModel());
    return all;
  }
};

// The bits of a binary32: whether it is +0; sign; exponent by its difference to the last one; the mantissa's 12 high
// bits as three symbols; whether any of the 11 others is set; those.
struct FloatModel {
  std::array<BitModel, 2> zero = {bitModel(kScale / 2), bitModel(kScale / 2)};
  std::array<BitModel, 2> sign = {bitModel(kScale / 2), bitModel(kScale / 2)};
  SymbolModel exponent = evenModel();
  ClassBits exponentBits;
  std::array<SymbolModel, 3> mantissa = {evenModel(), evenModel(), evenModel()};
  BitModel rest = bitModel(kScale / 2);
  std::uint32_t last = 0x3f800000;
  bool lastZero = false;

  template <class Coder>
  std::uint32_t code(Coder& coder, std::uint32_t value) {
    lastZero = coder.bit(zero[lastZero], value == 0);
    if (lastZero) return 0;
    const std::uint32_t negative = coder.bit(sign[last >> 31], value >> 31 != 0);
    const std::uint32_t scale = codeDifference(coder, exponent, exponentBits, 8, last >> 23 & 0xff, value >> 23 & 0xff);
    std::uint32_t bits = negative << 31 | scale << 23;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t at = 19 - 4 * i;
      bits |= coder.symbol(mantissa[i], value >> at & 15) << at;
    }
    if (coder.bit(rest, (value & 0x7ff) != 0)) bits |= coder.bits(11, value & 0x7ff);
    last = bits;
    return bits;
  }
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_NUMBER_MODEL_H
