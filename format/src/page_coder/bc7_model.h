// BC7 blocks by their fields: spec/pagecodec.md, "BC7".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_BC7_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_BC7_MODEL_H

#include <algorithm>
#include <cstring>
#include <span>

#include "billow/format/bc7_tables.h"
#include "number_model.h"

namespace billow::format::page_coder {

// The 128 bits of a block, read and replaced from the lowest on.
class BlockBits {
 public:
  explicit BlockBits(std::byte* block) : block_(block) { std::memcpy(words_, block, sizeof words_); }

  // The next `count` bits, at most 8, which put() then replaces.
  std::uint32_t peek(std::uint32_t count) const {
    const std::uint64_t low = words_[at_ >> 6] >> (at_ & 63);
    const std::uint64_t high = (at_ & 63) != 0 && at_ < 64 ? words_[1] << (64 - (at_ & 63)) : 0;
    return static_cast<std::uint32_t>((low | high) & ((1u << count) - 1));
  }
  void put(std::uint32_t count, std::uint32_t value) {
    for (std::uint32_t i = 0; i < count; ++i, ++at_) {
      const std::uint64_t bit = std::uint64_t{1} << (at_ & 63);
      words_[at_ >> 6] = (value >> i & 1) != 0 ? words_[at_ >> 6] | bit : words_[at_ >> 6] & ~bit;
    }
  }
  void store() { std::memcpy(block_, words_, sizeof words_); }

 private:
  std::byte* block_;
  std::uint64_t words_[2];
  std::uint32_t at_ = 0;
};

class Bc7Model {
 public:
  Bc7Model() {
    mode_.fill(evenModel());
    choice_.fill(evenModel());
    for (auto& models : ends_) models.fill(evenModel());
    pBits_.fill(bitModel(kScale / 2));
    for (auto& models : indices_) models.fill(evenModel());
  }

  template <class Coder>
  void code(Coder& coder, std::byte* block) {
    const auto low = std::to_integer<std::uint32_t>(block[0]) | 256;
    const auto first = static_cast<std::uint32_t>(std::countr_zero(low));
    const std::uint32_t mode = std::min(coder.symbol(mode_[modeBefore_], first), 8u);
    modeBefore_ = mode;
    BlockBits bits(block);
    if (mode >= 8) {
      for (int i = 0; i < 16; ++i) bits.put(8, coder.bits(8, bits.peek(8)));
    } else {
      bits.put(mode + 1, 1u << mode);
      codeFields(coder, bits, mode);
    }
    bits.store();
  }

 private:
  static constexpr std::uint32_t kIndexContexts = 65;

  template <class Coder>
  void codeFields(Coder& coder, BlockBits& bits, std::uint32_t number) {
    const Bc7Mode& mode = kBc7Modes[number];
    std::uint32_t partition = 0;
    if (mode.partitionBits > 0) {
      partition = partition_.code(coder, bits.peek(mode.partitionBits)) & ((1u << mode.partitionBits) - 1);
      bits.put(mode.partitionBits, partition);
    }
    const std::uint32_t choices = mode.rotationBits + mode.selectorBits;
    if (choices > 0) bits.put(choices, coder.symbol(choice_[number], bits.peek(choices)));
    const std::uint32_t ends = 2u * mode.subsets;
    std::array<std::uint32_t, 6> before;
    before.fill(128);
    for (std::uint32_t channel = 0; channel < 4; ++channel) {
      const std::uint32_t width = channel < 3 ? mode.colorBits : mode.alphaBits;
      if (width > 0) codeEnds(coder, bits, number, channel, width, std::span(before).first(ends));
    }
    const std::uint32_t pBits = mode.endpointPBits != 0 ? ends : mode.subsetPBits * mode.subsets;
    for (std::uint32_t i = 0; i < pBits; ++i) bits.put(1, coder.bit(pBits_[number], bits.peek(1) != 0));
    const std::uint32_t anchors = anchorsOf(mode.subsets, partition);
    codeIndices(coder, bits, mode.indexBits, anchors, indices_[mode.indexBits - 2u]);
    if (mode.indexBits2 > 0) codeIndices(coder, bits, mode.indexBits2, 1, indices_[3]);
  }

  // The ends of one channel, each by its difference to the same end of the channel before; `before` is in 8 bits.
  template <class Coder>
  void codeEnds(Coder& coder, BlockBits& bits, std::uint32_t number, std::uint32_t channel, std::uint32_t width,
                std::span<std::uint32_t> before) {
    int moved = 0;
    for (std::uint32_t end = 0; end < before.size(); ++end) {
      std::uint32_t guess = before[end];
      if ((end & 1) != 0) guess = static_cast<std::uint32_t>(std::clamp(static_cast<int>(guess) + moved / 2, 0, 255));
      SymbolModel& model = ends_[number][channel * 2 + (end & 1)];
      const std::uint32_t value = codeDifference(coder, model, endBits_, width, guess >> (8 - width), bits.peek(width));
      bits.put(width, value);
      const std::uint32_t wide = value << (8 - width);
      moved = static_cast<int>(wide) - static_cast<int>(before[end]);
      before[end] = wide;
    }
  }

  // The set of texels whose index lacks its high bit.
  static std::uint32_t anchorsOf(std::uint32_t subsets, std::uint32_t partition) {
    if (subsets == 2) return 1 | 1u << bc7Anchor(kBc7Anchors2, partition);
    if (subsets == 1) return 1;
    return 1 | 1u << bc7Anchor(kBc7Anchors3Second, partition) | 1u << bc7Anchor(kBc7Anchors3Third, partition);
  }

  static std::uint32_t indexContext(const std::uint32_t* known, std::uint32_t texel) {
    const bool hasLeft = (texel & 3) != 0;
    const bool hasAbove = texel >= 4;
    if (!hasLeft && !hasAbove) return 64;
    if (!hasLeft) return 48 + known[texel - 4];
    if (!hasAbove) return 48 + known[texel - 1];
    const std::uint32_t left = known[texel - 1];
    const std::uint32_t above = known[texel - 4];
    const std::uint32_t apart = left > above ? left - above : above - left;
    return (left + above + 1) / 2 * 3 + std::min(apart, 2u);
  }

  template <class Coder>
  static void codeIndices(Coder& coder, BlockBits& bits, std::uint32_t width, std::uint32_t anchors,
                          std::array<SymbolModel, kIndexContexts>& models) {
    std::uint32_t known[16];
    for (std::uint32_t texel = 0; texel < 16; ++texel) {
      const std::uint32_t stored = width - (anchors >> texel & 1);
      const std::uint32_t index = coder.symbol(models[indexContext(known, texel)], bits.peek(stored));
      known[texel] = index & ((1u << stored) - 1);
      bits.put(stored, known[texel]);
    }
  }

  std::array<SymbolModel, 9> mode_;
  std::array<SymbolModel, 8> choice_;
  ByteModel partition_;
  std::array<std::array<SymbolModel, 8>, 8> ends_;
  ClassBits endBits_;
  std::array<BitModel, 8> pBits_;
  std::array<std::array<SymbolModel, kIndexContexts>, 4> indices_;
  std::uint32_t modeBefore_ = 8;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_BC7_MODEL_H
