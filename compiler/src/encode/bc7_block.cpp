#include "encode/bc7_block.h"

#include <algorithm>
#include <utility>

#include "billow/format/bc7_tables.h"

namespace billow::compiler {
namespace {

class BitWriter {
 public:
  // The lowest `count` bits of `value`, at most 32.
  void put(std::uint32_t value, std::uint32_t count) {
    if (count == 0) return;
    const std::uint64_t bits = value & (0xffffffffu >> (32 - count));
    const std::uint32_t shift = position_ & 63;
    words_[position_ >> 6] |= bits << shift;
    if (shift + count > 64) words_[1] |= bits >> (64 - shift);
    position_ += count;
  }
  void store(std::byte* block) const {
    for (std::uint32_t i = 0; i < 16; ++i) block[i] = static_cast<std::byte>(words_[i >> 3] >> (8 * (i & 7)) & 0xff);
  }

 private:
  std::uint64_t words_[2] = {};
  std::uint32_t position_ = 0;
};

// A fit in integers.
struct Fields {
  std::uint32_t ends[4][4];    // two a subset, RGBA, eight bits
  std::uint32_t steps[2][16];  // all channels or colour; the separate channel
};

Fields toFields(const Bc7Fit& fit) {
  Fields fields{};
  for (std::uint32_t c = 0; c < 4; ++c) {
    for (std::uint32_t s = 0; s < 2; ++s) {
      fields.ends[2 * s][c] = static_cast<std::uint32_t>(fit.line[s].first[c]);
      fields.ends[2 * s + 1][c] = static_cast<std::uint32_t>(fit.line[s].second[c]);
    }
  }
  for (std::uint32_t i = 0; i < 16; ++i) {
    fields.steps[0][i] = static_cast<std::uint32_t>(fit.steps.step[i >> 2][i & 3]);
    fields.steps[1][i] = static_cast<std::uint32_t>(fit.separateSteps.step[i >> 2][i & 3]);
  }
  return fields;
}

// Turns a line round where its anchor's step has the high bit that is not stored. `texels`: those on the line.
void anchorLine(std::uint32_t steps[16], std::uint32_t bits, std::uint32_t anchor, std::uint32_t texels,
                std::uint32_t* first, std::uint32_t* second, std::uint32_t channels) {
  if (steps[anchor] >> (bits - 1) == 0) return;
  for (std::uint32_t i = 0; i < 16; ++i) {
    if ((texels >> i & 1u) != 0) steps[i] = (1u << bits) - 1 - steps[i];
  }
  std::swap_ranges(first, first + channels, second);
}

void putEnds(const format::Bc7Mode& mode, const Fields& fields, BitWriter& writer) {
  const std::uint32_t count = 2u * mode.subsets;
  for (std::uint32_t c = 0; c < 4; ++c) {
    const std::uint32_t bits = c < 3 ? mode.colorBits : mode.alphaBits;
    for (std::uint32_t e = 0; e < count; ++e) writer.put(fields.ends[e][c] >> (8 - bits), bits);
  }
  if (mode.endpointPBits == 0) return;
  for (std::uint32_t e = 0; e < count; ++e) writer.put(fields.ends[e][0] >> (7 - mode.colorBits) & 1u, 1);
}

void putSteps(const std::uint32_t steps[16], std::uint32_t bits, std::uint32_t anchors, BitWriter& writer) {
  for (std::uint32_t i = 0; i < 16; ++i) writer.put(steps[i], bits - (anchors >> i & 1u));
}

}  // namespace

Bc7Search bc7Search(int effort) {
  static constexpr Bc7Search kSearches[] = {
      // passes, rotations, ranked, partitions, mode4, allPBits, nudge, everyAxis
      {2, 0, 0, 0, false, false, false, false}, {2, 1, 16, 1, true, false, false, false},
      {3, 1, 64, 2, true, false, false, false}, {3, 4, 64, 4, true, true, false, true},
      {4, 4, 64, 10, true, true, true, true},   {8, 4, 64, 64, true, true, true, true},
  };
  return kSearches[std::clamp(effort, 0, 5)];
}

void tryOtherModes(const Plane& plane, const Bc7Search& search, Bc7Fit& best) {
  if (best.error <= 0.0f) return;
  if (search.rotations > 0) tryModes4And5(plane, search, best);
  if (search.partitions > 0) tryMode7(plane, search, best);
}

void packBlock(const Bc7Fit& fit, std::byte* block) {
  const format::Bc7Mode& mode = format::kBc7Modes[fit.mode];
  Fields fields = toFields(fit);
  const bool separate = mode.indexBits2 != 0;
  const std::uint32_t bits = fit.colorIsSecond ? mode.indexBits2 : mode.indexBits;
  const std::uint32_t second = mode.subsets == 2 ? format::kBc7Partitions2[fit.partition] : 0u;
  std::uint32_t anchors = 1;
  anchorLine(fields.steps[0], bits, 0, ~second, fields.ends[0], fields.ends[1], separate ? 3 : 4);
  if (mode.subsets == 2) {
    const std::uint32_t anchor = format::bc7Anchor(format::kBc7Anchors2, fit.partition);
    anchorLine(fields.steps[0], bits, anchor, second, fields.ends[2], fields.ends[3], 4);
    anchors |= 1u << anchor;
  }
  const std::uint32_t separateBits = fit.colorIsSecond ? mode.indexBits : mode.indexBits2;
  if (separate) {
    anchorLine(fields.steps[1], separateBits, 0, 0xffffu, &fields.ends[0][3], &fields.ends[1][3], 1);
  }
  BitWriter writer;
  writer.put(1u << fit.mode, fit.mode + 1);
  writer.put(fit.partition, mode.partitionBits);
  writer.put(fit.rotation, mode.rotationBits);
  writer.put(fit.colorIsSecond ? 1 : 0, mode.selectorBits);
  putEnds(mode, fields, writer);
  putSteps(fields.steps[fit.colorIsSecond ? 1 : 0], mode.indexBits, anchors, writer);
  if (separate) putSteps(fields.steps[fit.colorIsSecond ? 0 : 1], mode.indexBits2, anchors, writer);
  writer.store(block);
}

}  // namespace billow::compiler
