// Tokens of voxels, as an encoder keeps and a decoder reads them: spec/pagecodec.md, "Voxels".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_TOKENS_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_TOKENS_H

#include "token_tables.h"

namespace billow::format::page_coder {

// Differences as numbers: 0, -1, 1, -2, 2 ... Of them, the small ones are tokens; above there are four to an octave.
inline constexpr std::uint32_t kPlainTokens = 16;
constexpr std::uint32_t differenceOf(std::uint32_t number) {
  return number >> 1 ^ (0u - (number & 1));
}
constexpr std::uint32_t extraBits(std::uint32_t token) {
  return token < kPlainTokens ? 0 : token / 4 - 2;
}
struct TokenRange {
  std::uint8_t first, extra;
};
inline constexpr auto kTokenRanges = [] {
  std::array<TokenRange, kTokens> ranges{};
  for (std::uint32_t token = 0; token < kTokens; ++token) {
    const std::uint32_t extra = extraBits(token);
    const std::uint32_t first = token < kPlainTokens ? token : (4 + token % 4) << extra;
    ranges[token] = {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(extra)};
  }
  return ranges;
}();
inline constexpr auto kTokenOf = [] {
  std::array<std::uint8_t, 256> tokens{};
  for (std::uint32_t token = 0; token < kTokens; ++token) {
    for (std::uint32_t i = kTokenRanges[token].first; i < tokens.size(); ++i) {
      tokens[i] = static_cast<std::uint8_t>(token);
    }
  }
  return tokens;
}();

// Keeps what is coded until the tables are known that suit it.
class TokenRecorder {
 public:
  static constexpr bool kDecodes = false;

  explicit TokenRecorder(std::size_t bricks) : room_(places()) {
    if (room_.size() < bricks * kMostTokens) room_.resize(bricks * kMostTokens);
    end_ = room_.data();
  }

  void beginVoxels() {}
  std::uint32_t token(std::uint32_t context, std::uint32_t value) {
    add(context | value, 0);
    return value;
  }
  void number(std::uint32_t context, std::uint32_t number) {
    const std::uint32_t token = kTokenOf[number];
    add(context | token, number - kTokenRanges[token].first);
  }

  const TokenCounts& counts() const { return counts_; }
  void replay(RansEncoder& rans, const TokenTables& tables) const {
    rans.reserve(static_cast<std::size_t>(end_ - room_.data()));
    for (const Token* token = room_.data(); token != end_; ++token) {
      const auto [start, size] = tables.intervals()[token->kind];
      rans.put(start, size);
      const std::uint32_t extra = kTokenRanges[token->kind % kTokens].extra;
      if (extra != 0) rans.putBits(extra, token->extra);
    }
  }

 private:
  static constexpr std::size_t kMostTokens = 512 + 64;  // of a brick: voxels, and rows that are empty or not
  struct Token {
    std::uint16_t kind;
    std::uint16_t extra;
  };
  static std::vector<Token>& places() {  // some 100 000 a page: one place a thread
    thread_local std::vector<Token> room;
    return room;
  }
  void add(std::uint32_t kind, std::uint32_t extra) {
    ++counts_[kind];
    *end_++ = {static_cast<std::uint16_t>(kind), static_cast<std::uint16_t>(extra)};
  }

  std::vector<Token>& room_;
  Token* end_;
  TokenCounts counts_{};
};

class TokenReader {
 public:
  static constexpr bool kDecodes = true;

  TokenReader(const RansDecoder& rans, const TokenTables& tables)
      : rans_(rans), slots_(tables.slots()), intervals_(tables.intervals()) {}

  // Before at most eight voxels.
  void beginVoxels() {
    rans_.stayInside();
    rans_.refill();
  }
  std::uint32_t token(std::uint32_t context, std::uint32_t) {
    const std::uint32_t slot = rans_.peek() / TokenTables::kSlotSize;
    const std::uint32_t token = slots_[context * (TokenTables::kSlots / kTokens) + slot];
    const auto [start, size] = intervals_[context | token];
    rans_.takeUnchecked(start, size);
    return token;
  }
  std::uint32_t difference(std::uint32_t context) {
    const std::uint32_t which = token(context, 0);
    if (which < kPlainTokens) [[likely]] {
      return differenceOf(which);
    }
    const auto [first, extra] = kTokenRanges[which];
    return differenceOf(first + rans_.readyBits(extra));
  }
  const RansDecoder& rans() const { return rans_; }

 private:
  RansDecoder rans_;
  const std::uint8_t* slots_;
  const TokenTables::Interval* intervals_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_TOKENS_H
