// Sizes of tokens in contexts, of one page, which the page brings with it: spec/pagecodec.md, "Tables".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_TOKEN_TABLES_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_TOKEN_TABLES_H

#include <algorithm>

#include "models.h"

namespace billow::format::page_coder {

inline constexpr std::uint32_t kTokens = 32;
inline constexpr std::uint32_t kEdges = 9, kLevels = 9;
inline constexpr std::uint32_t kRowContexts = 4;  // then those of voxels: kRowContexts + level * kEdges + edge
inline constexpr std::uint32_t kTokenContexts = kRowContexts + kLevels * kEdges;
inline constexpr std::uint32_t kTokenKinds = kTokenContexts * kTokens;  // context * kTokens + token
using TokenCounts = std::array<std::uint32_t, kTokenKinds>;

class TokenTables {
 public:
  struct Interval {
    std::uint16_t start, size;
  };

  // Codes the tables: of an encoder those that suit `counts`.
  template <class Coder>
  void code(Coder& coder, const TokenCounts& counts);

  // By context * kTokens + token.
  const Interval* intervals() const { return intervals_.data(); }
  // By context * kSlots + number / kSlotSize: the token whose interval holds the number.
  const std::uint8_t* slots() const { return slots_.data(); }
  static constexpr std::uint32_t kSlots = 1024;
  static constexpr std::uint32_t kSlotSize = kScale / kSlots;

 private:
  using Classes = std::array<std::uint8_t, kTokens>;  // of sizes
  static constexpr std::array<std::uint16_t, kSymbols> kWeights = {0,   1,   4,   16,   64,   128,  192,  256,
                                                                   384, 512, 768, 1024, 1536, 2048, 3072, 4096};

  // The class whose weight beside the greatest one is nearest to `count` beside `most`, by their ratio.
  static std::uint8_t classOf(std::uint32_t count, std::uint32_t most) {
    // Means of neighbouring weights, geometric ones, in 16ths.
    static constexpr std::uint32_t kBounds[] = {32,   128,   512,   1448,  2508,  3547,  5017,
                                                7094, 10033, 14189, 20066, 28378, 40132, 56755};
    if (count == 0) return 0;
    const auto ratio = static_cast<std::uint32_t>((std::uint64_t{count} << 16) / most);
    const auto* above = std::upper_bound(std::begin(kBounds), std::end(kBounds), ratio);
    return static_cast<std::uint8_t>(1 + (above - std::begin(kBounds)));
  }

  static Classes classesOf(const std::uint32_t* counts) {
    const std::uint32_t most = *std::max_element(counts, counts + kTokens);
    Classes classes;
    for (std::uint32_t i = 0; i < kTokens; ++i) classes[i] = classOf(counts[i], most);
    return classes;
  }

  // Every token of a class other than 0 has at least one slot; without any, token 0 has all.
  void fill(std::uint32_t context, const Classes& classes) {
    std::uint32_t weights = 0, used = 0;
    for (const std::uint8_t c : classes) {
      weights += kWeights[c];
      used += c != 0;
    }
    std::uint8_t* slots = slots_.data() + context * kSlots;
    std::uint32_t below = 0, usedBelow = 0, start = 0;
    for (std::uint32_t token = 0; token < kTokens; ++token) {
      below += kWeights[classes[token]];
      usedBelow += classes[token] != 0;
      const std::uint32_t end = weights == 0 ? kSlots : below * (kSlots - used) / weights + usedBelow;
      intervals_[context * kTokens + token] = {static_cast<std::uint16_t>(start * kSlotSize),
                                               static_cast<std::uint16_t>((end - start) * kSlotSize)};
      std::fill(slots + start, slots + end, static_cast<std::uint8_t>(token));
      start = end;
    }
  }

  std::array<std::uint8_t, kTokenContexts * kSlots> slots_;
  std::array<Interval, kTokenKinds> intervals_;
};

template <class Coder>
void TokenTables::code(Coder& coder, const TokenCounts& counts) {
  std::array<SymbolModel, kSymbols> models;  // by the token's class in the context one level below
  models.fill(evenModel());
  BitModel anyModel = bitModel(kScale / 2);
  std::array<Classes, kTokenContexts> classes{};
  for (std::uint32_t context = 0; context < kTokenContexts; ++context) {
    Classes& now = classes[context];
    Classes below{};
    if (context > 0) below = classes[context - (context < kRowContexts + kEdges ? 1 : kEdges)];
    Classes wanted{};
    if (!Coder::kDecodes) wanted = classesOf(counts.data() + context * kTokens);
    if (coder.bit(anyModel, wanted != Classes{})) {
      for (std::uint32_t token = 0; token < kTokens; ++token) {
        now[token] = static_cast<std::uint8_t>(coder.symbol(models[below[token]], wanted[token]));
      }
    } else {
      now = below;
    }
    fill(context, now);
  }
}

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_TOKEN_TABLES_H
