// Adaptive models of single symbols, and the two coders that share every line of the models above them: both take the
// value to code and return it; a decoder ignores what it is given. spec/pagecodec.md.
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_MODELS_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_MODELS_H

#include <array>
#include <bit>
#include <cstdint>
#include <iterator>

#include "rans.h"
#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace billow::format::page_coder {

inline constexpr std::uint32_t kSymbols = 16;

// How far a model moves towards what it saw: by 2^-n of the way; faster while it is young.
inline std::uint32_t symbolRate(std::uint32_t seen) {
  return 4 + (seen >= 8) + (seen >= 32) + (seen >= 128);
}
inline std::uint32_t bitRate(std::uint32_t seen) {
  constexpr std::uint8_t kRates[] = {2, 2, 3, 3, 3, 4, 4, 4};
  return seen < std::size(kRates) ? kRates[seen] : 5 + (seen >= 32);
}

// 16 symbols: below[s] is the sum of the sizes of all symbols before s, strictly increasing from below[0] = 0.
struct alignas(16) SymbolModel {
  std::array<std::int16_t, kSymbols> below;
  std::uint32_t seen;
};

struct BitModel {
  std::uint16_t one;  // size of 1, in [32, kScale - 32]
  std::uint16_t seen;
};

constexpr SymbolModel evenModel() {
  SymbolModel model{};
  for (std::uint32_t i = 0; i < kSymbols; ++i) {
    model.below[i] = static_cast<std::int16_t>(i * (kScale / kSymbols));
  }
  return model;
}
constexpr BitModel bitModel(std::uint32_t one) {
  return {static_cast<std::uint16_t>(one), 0};
}

inline std::uint32_t sizeOf(const SymbolModel& model, std::uint32_t symbol) {
  const std::uint32_t end = symbol + 1 < kSymbols ? static_cast<std::uint32_t>(model.below[symbol + 1]) : kScale;
  return end - static_cast<std::uint32_t>(model.below[symbol]);
}

// below[i] moves towards i for i <= symbol, else towards kScale - 16 + i: so every size stays at least 1.
inline void adapt(SymbolModel& model, std::uint32_t symbol) {
  const std::uint32_t rate = symbolRate(model.seen);
  model.seen += model.seen < 128;
#ifdef __SSE2__
  const __m128i shift = _mm_cvtsi32_si128(static_cast<int>(rate));
  const __m128i chosen = _mm_set1_epi16(static_cast<std::int16_t>(symbol));
  const __m128i rise = _mm_set1_epi16(static_cast<std::int16_t>(kScale - kSymbols));
  auto* lanes = reinterpret_cast<__m128i*>(model.below.data());
  for (int half = 0; half < 2; ++half) {
    const __m128i index =
        _mm_add_epi16(_mm_setr_epi16(0, 1, 2, 3, 4, 5, 6, 7), _mm_set1_epi16(static_cast<std::int16_t>(8 * half)));
    const __m128i target = _mm_add_epi16(index, _mm_and_si128(_mm_cmpgt_epi16(index, chosen), rise));
    const __m128i now = _mm_load_si128(lanes + half);
    _mm_store_si128(lanes + half, _mm_add_epi16(now, _mm_sra_epi16(_mm_sub_epi16(target, now), shift)));
  }
#else
  for (std::uint32_t i = 0; i < kSymbols; ++i) {
    const int target = static_cast<int>(i > symbol ? kScale - kSymbols + i : i);
    model.below[i] = static_cast<std::int16_t>(model.below[i] + ((target - model.below[i]) >> rate));
  }
#endif
}

// The last symbol whose interval begins at or below `number`.
inline std::uint32_t find(const SymbolModel& model, std::uint32_t number) {
#ifdef __SSE2__
  const __m128i wanted = _mm_set1_epi16(static_cast<std::int16_t>(number));
  const auto* lanes = reinterpret_cast<const __m128i*>(model.below.data());
  const __m128i above = _mm_packs_epi16(_mm_cmpgt_epi16(_mm_load_si128(lanes), wanted),
                                        _mm_cmpgt_epi16(_mm_load_si128(lanes + 1), wanted));
  return static_cast<std::uint32_t>(std::countr_zero(static_cast<std::uint32_t>(_mm_movemask_epi8(above)) | 0x10000u)) -
         1;
#else
  std::uint32_t symbol = 0;
  for (std::uint32_t i = 1; i < kSymbols; ++i) symbol += static_cast<std::uint32_t>(model.below[i]) <= number;
  return symbol;
#endif
}

inline void adapt(BitModel& model, bool bit) {
  const std::uint32_t rate = bitRate(model.seen);
  model.seen = static_cast<std::uint16_t>(model.seen + (model.seen < 32));
  constexpr int kLeast = 32;
  const int target = bit ? static_cast<int>(kScale) - kLeast : kLeast;
  model.one = static_cast<std::uint16_t>(model.one + ((target - model.one) >> rate));
}

class Encoder {
 public:
  static constexpr bool kDecodes = false;

  std::uint32_t symbol(SymbolModel& model, std::uint32_t value) {
    rans_.put(static_cast<std::uint32_t>(model.below[value]), sizeOf(model, value));
    adapt(model, value);
    return value;
  }
  bool bit(BitModel& model, bool value) {
    rans_.put(value ? 0 : model.one, value ? model.one : kScale - model.one);
    adapt(model, value);
    return value;
  }
  // `count` bits without a model, at most 32.
  std::uint32_t bits(std::uint32_t count, std::uint32_t value) {
    rans_.putBits(count, value);
    return value;
  }
  RansEncoder& rans() { return rans_; }
  std::vector<std::byte> finish() { return rans_.finish(); }

 private:
  RansEncoder rans_;
};

class Decoder {
 public:
  static constexpr bool kDecodes = true;

  explicit Decoder(const PaddedBytes& bytes) : rans_(bytes) {}

  std::uint32_t symbol(SymbolModel& model, std::uint32_t) {
    const std::uint32_t value = find(model, rans_.peek());
    rans_.take(static_cast<std::uint32_t>(model.below[value]), sizeOf(model, value));
    adapt(model, value);
    return value;
  }
  bool bit(BitModel& model, bool) {
    const bool value = rans_.peek() < model.one;
    rans_.take(value ? 0 : model.one, value ? model.one : kScale - model.one);
    adapt(model, value);
    return value;
  }
  std::uint32_t bits(std::uint32_t count, std::uint32_t) { return rans_.bits(count); }
  RansDecoder& rans() { return rans_; }
  bool sound() const { return rans_.sound(); }

 private:
  RansDecoder rans_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_MODELS_H
