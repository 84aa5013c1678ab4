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
    if (shift + count > 64) words_[1] |= bits >> 1 >> (63 - shift);
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

Fields toFields(const format::Bc7Mode& mode, const Bc7Fits& fits, std::uint32_t block) {
  Fields fields{};
  for (std::uint32_t c = 0; c < 4; ++c) {
    for (std::uint32_t s = 0; s < mode.subsets; ++s) {
      fields.ends[2 * s][c] = static_cast<std::uint32_t>(fits.first[s][c][block]);
      fields.ends[2 * s + 1][c] = static_cast<std::uint32_t>(fits.second[s][c][block]);
    }
  }
  for (std::uint32_t i = 0; i < 16; ++i) fields.steps[0][i] = static_cast<std::uint32_t>(fits.step[i][block]);
  if (mode.indexBits2 == 0) return fields;
  for (std::uint32_t i = 0; i < 16; ++i) fields.steps[1][i] = static_cast<std::uint32_t>(fits.separateStep[i][block]);
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
  std::uint64_t together = 0;
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < 16; ++i) {
    together |= static_cast<std::uint64_t>(steps[i]) << count;
    count += bits - (anchors >> i & 1u);
  }
  // Two to four bits a step, less one for each anchor: 30 to 63.
  writer.put(static_cast<std::uint32_t>(together & 0xffff), 16);
  writer.put(static_cast<std::uint32_t>(together >> 16 & 0xffff), std::min(count - 16, 16u));
  if (count > 32) writer.put(static_cast<std::uint32_t>(together >> 32), count - 32);
}

}  // namespace

Bc7Search bc7Search(int effort) {
  static constexpr Bc7Search kSearches[] = {
      // passes, starts, rotations, ranked, partitions, nudges, mode5, allPBits, everyAxis, ranges
      {1, 1, 0, 0, 0, 0, false, false, false, 0},  // 0: mode 6 alone
      {1, 1, 1, 16, 1, 0, false, false, false,
       0},  // 1: the other modes, with the likeliest rotation and partition of 16
      {2, 1, 1, 64, 2, 0, false, false, false, 0},  // 2: the two likeliest of all partitions
      {2, 1, 4, 64, 4, 0, true, true, true, 0},     // 3: all modes, rotations and p-bits along each packed axis
      {2, 2, 4, 64, 4, 0, true, true, true, 1},     // 4: a second first guess; the brick's range solved with the blocks
      {2, 2, 4, 64, 6, 1, true, true, true, 1},     // 5: ends moved by single steps
      {3, 3, 4, 64, 8, 2, true, true, true, 1},     // 6: a third guess, more steps and partitions
      {3, 3, 4, 64, 12, 4, true, true, true, 2},    // 7: the same, until little is gained
      {4, 4, 4, 64, 16, 4, true, true, true, 3},    // 8: a fourth guess
      {6, 4, 4, 64, 32, 8, true, true, true, 4},    // 9: half of all partitions
  };
  return kSearches[std::clamp(effort, 0, 9)];
}

void packBlock(const Bc7Fits& fits, std::uint32_t block, std::byte* bytes) {
  const auto number = static_cast<std::uint32_t>(fits.mode[block]);
  const format::Bc7Mode& mode = format::kBc7Modes[number];
  const std::uint32_t partition = mode.subsets == 2 ? static_cast<std::uint32_t>(fits.partition[block]) : 0;
  const bool colorIsSecond = number == 4 && fits.colorIsSecond[block] != 0;
  Fields fields = toFields(mode, fits, block);
  const bool separate = mode.indexBits2 != 0;
  const std::uint32_t bits = colorIsSecond ? mode.indexBits2 : mode.indexBits;
  const std::uint32_t second = mode.subsets == 2 ? format::kBc7Partitions2[partition] : 0u;
  std::uint32_t anchors = 1;
  anchorLine(fields.steps[0], bits, 0, ~second, fields.ends[0], fields.ends[1], separate ? 3 : 4);
  if (mode.subsets == 2) {
    const std::uint32_t anchor = format::bc7Anchor(format::kBc7Anchors2, partition);
    anchorLine(fields.steps[0], bits, anchor, second, fields.ends[2], fields.ends[3], 4);
    anchors |= 1u << anchor;
  }
  const std::uint32_t separateBits = colorIsSecond ? mode.indexBits : mode.indexBits2;
  if (separate) {
    anchorLine(fields.steps[1], separateBits, 0, 0xffffu, &fields.ends[0][3], &fields.ends[1][3], 1);
  }
  BitWriter writer;
  writer.put(1u << number, number + 1);
  writer.put(partition, mode.partitionBits);
  if (mode.rotationBits != 0) writer.put(static_cast<std::uint32_t>(fits.rotation[block]), mode.rotationBits);
  writer.put(colorIsSecond ? 1 : 0, mode.selectorBits);
  putEnds(mode, fields, writer);
  putSteps(fields.steps[colorIsSecond ? 1 : 0], mode.indexBits, anchors, writer);
  if (separate) putSteps(fields.steps[colorIsSecond ? 0 : 1], mode.indexBits2, anchors, writer);
  writer.store(bytes);
}

}  // namespace billow::compiler
