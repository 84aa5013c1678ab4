#include "voxel_model.h"

#include <algorithm>
#include <cstring>

#include "voxel_tokens.h"

namespace billow::format::page_coder {
namespace {

// How many of the bounds a number has reached.
template <std::size_t kCount>
constexpr std::uint32_t classOf(std::uint32_t number, const std::uint8_t (&bounds)[kCount]) {
  std::uint32_t result = 0;
  for (const std::uint8_t bound : bounds) result += number >= bound;
  return result;
}

// Numbers of eight z at once.
using Lanes = std::int16_t __attribute__((vector_size(16)));

Lanes loadLanes(const std::int16_t* at) {
  Lanes lanes;
  std::memcpy(&lanes, at, sizeof lanes);
  return lanes;
}
void storeLanes(std::int16_t* at, Lanes lanes) {
  std::memcpy(at, &lanes, sizeof lanes);
}
Lanes larger(Lanes a, Lanes b) {
  return a > b ? a : b;
}
Lanes smaller(Lanes a, Lanes b) {
  return a < b ? a : b;
}
Lanes apart(Lanes a, Lanes b) {
  return larger(a, b) - smaller(a, b);
}

// By place, whether z > 0 and the steps between neighbours: what their level adds to a kind of token.
constexpr std::int32_t kMostSteps = 127;
using LevelKinds = std::array<std::uint16_t, kMostSteps + 1>;
constexpr auto kLevelKinds = [] {
  constexpr std::uint32_t kScales[4][2] = {{0, 128}, {64, 44}, {51, 37}, {37, 28}};  // 256 / how many are summed
  std::array<std::array<LevelKinds, 2>, 4> all{};
  for (std::uint32_t place = 0; place < 4; ++place) {
    for (std::uint32_t above = 0; above < 2; ++above) {
      for (std::uint32_t steps = 0; steps <= kMostSteps; ++steps) {
        const std::uint32_t level = classOf(steps * kScales[place][above] >> 5, {2, 4, 7, 12, 20, 32, 56, 100});
        all[place][above][steps] = static_cast<std::uint16_t>((kRowContexts + level * kEdges) * kTokens);
      }
    }
  }
  return all;
}();

// By bits and the expected index in eighths: the same of the edge that it is near.
using EdgeKinds = std::array<std::uint16_t, 8 * 255 + 1>;
constexpr auto kEdgeKinds = [] {
  std::array<EdgeKinds, 9> all{};
  for (std::uint32_t bits = 1; bits <= 8; ++bits) {
    const std::uint32_t most = 8 * ((1u << bits) - 1);
    for (std::uint32_t i = 0; i <= most; ++i) {
      const std::uint32_t edge = most - i < 12 ? kEdges - 1 : classOf(i, {4, 8, 12, 20, 36, 72, 144});
      all[bits][i] = static_cast<std::uint16_t>(edge * kTokens);
    }
  }
  return all;
}();

// One brick as it is coded, row by row.
class BrickRows {
 public:
  void begin(const VoxelBrick& brick) {
    brick_ = brick;
    greatest_ = (1u << brick.bits) - 1;
    most_ = 8 * static_cast<std::int32_t>(greatest_);
    edges_ = kEdgeKinds[brick.bits].data();
    std::memset(values_, 0, sizeof values_);
  }

  // Which voxels of the row are coded.
  template <class Tokens>
  std::uint32_t beginRow(Tokens& tokens, std::uint32_t x, std::uint32_t y) {
    payload_ = brick_.indices + (x << 3 | y) * brick_.bits;
    place_ = 2 * (x > 0) + (y > 0);
    row_ = values_[x + 1][y + 1];
    left_ = y > 0 ? values_[x + 1][y] : values_[x][y + 1];
    behind_ = x > 0 ? values_[x][y + 1] : left_;
    const std::int16_t* beside = x > 0 ? values_[x][y + 2] : behind_;
    const std::int16_t* corner = place_ == 3 ? values_[x][y] : behind_;
    packed_ = 0;
    if (!Tokens::kDecodes) std::memcpy(&packed_, payload_, brick_.bits);
    const std::uint32_t coded = codedVoxels(tokens, x << 3 | y, beside, corner);
    if (coded != 0) lookAhead(beside, corner);
    if (!Tokens::kDecodes && coded != 0) prepareRow();
    before_ = 0;
    return coded;
  }

  template <bool kFirst>
  [[gnu::always_inline]] void codeVoxel(TokenReader& tokens, std::uint32_t z) {
    std::int32_t steps = steps_[z];
    // |before - a| + |before - b| less |a - b|, which steps_ has already.
    if (!kFirst) steps += 2 * std::max({before_ - mostBelow_[z], leastBelow_[z] - before_, 0});
    const std::int32_t eighths = std::clamp((sums_[z] + weight_ * before_) >> 3, 0, most_);
    const std::uint32_t level = levels_[!kFirst][static_cast<std::uint32_t>(std::min(steps, kMostSteps))];
    const std::uint32_t difference = tokens.difference(level + std::uint32_t{edges_[eighths]});
    const std::uint32_t expected = static_cast<std::uint32_t>(eighths + 4) >> 3;
    before_ = static_cast<std::int32_t>((expected + difference) & greatest_);
    row_[z + 1] = static_cast<std::int16_t>(before_);
  }
  template <bool kFirst>
  void codeVoxel(TokenRecorder& tokens, std::uint32_t z) {
    const std::uint32_t level = levels_[!kFirst][static_cast<std::uint16_t>(steps_[z])];
    tokens.number(level + std::uint32_t{edges_[sums_[z]]}, static_cast<std::uint16_t>(numbers_[z]));
  }
  void skipVoxel() { before_ = 0; }

  template <class Tokens>
  void endRow(std::uint32_t y) {
    row_[0] = row_[1];
    row_[9] = row_[8];
    if (Tokens::kDecodes) packRow();
    if (y == 7) std::memcpy(row_ + kRow, row_, sizeof values_[0][0]);
  }

 private:
  static constexpr std::size_t kRow = 16;  // z at z + 1, its ends repeated before and after

  template <class Tokens>
  std::uint32_t codedVoxels(Tokens& tokens, std::uint32_t row, const std::int16_t* beside, const std::int16_t* corner) {
    if (brick_.mask != nullptr) return brick_.mask[row];
    const Lanes any = loadLanes(left_ + 1) | loadLanes(behind_ + 1) | loadLanes(beside + 1) | loadLanes(corner + 1);
    std::uint64_t halves[2];
    std::memcpy(halves, &any, sizeof any);
    if ((halves[0] | halves[1]) != 0) return 0xff;
    return tokens.token(place_ * kTokens, packed_ != 0) != 0 ? 0xff : 0;
  }

  // What is known of the row before its first voxel: sums of weighted neighbours and of steps between them.
  void lookAhead(const std::int16_t* beside, const std::int16_t* corner) {
    // 64ths of: left (y - 1), behind (x - 1), corner (both), left at z - 1, behind at z - 1, corner at z - 1, behind at
    // z + 1, beside (x - 1, y + 1), left at z + 1. By place (x > 0, y > 0) and whether z > 0.
    static constexpr std::int16_t kWeights[4][2][9] = {
        {{0, 0, 0, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}},
        {{39, 0, 0, 0, 0, 0, 0, 0, 20}, {22, 0, 0, -5, 0, 0, 0, 0, 14}},
        {{0, 32, 0, 0, 0, 0, 15, 14, 0}, {0, 20, 0, 0, -6, 0, 12, 6, 0}},
        {{26, 19, -4, 0, 0, 0, 4, 12, 8}, {19, 16, -3, -3, -3, -3, 5, 7, 7}}};
    static constexpr std::int32_t kBefore[4] = {56, 32, 32, 24};  // 64ths of the voxel at z - 1
    const Lanes lanes[9] = {loadLanes(left_ + 1),   loadLanes(behind_ + 1), loadLanes(corner + 1),
                            loadLanes(left_),       loadLanes(behind_),     loadLanes(corner),
                            loadLanes(behind_ + 2), loadLanes(beside + 1),  loadLanes(left_ + 2)};
    const auto& [left, behind, diagonal, leftBelow, behindBelow, diagonalBelow, behindAbove, next, leftAbove] = lanes;
    Lanes sums{};
    std::int32_t first = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      sums += lanes[i] * kWeights[place_][1][i];
      first += lanes[i][0] * kWeights[place_][0][i];
    }
    storeLanes(sums_, sums);
    sums_[0] = static_cast<std::int16_t>(place_ == 0 ? 4 * most_ : first);
    weight_ = kBefore[place_];
    const Lanes steps = apart(left, leftBelow) + apart(behind, behindBelow) + apart(left, diagonal) +
                        apart(behind, diagonal) + apart(leftAbove, left) + apart(behindAbove, behind) +
                        apart(next, behind);
    const Lanes most = larger(leftBelow, behindBelow);
    const Lanes least = smaller(leftBelow, behindBelow);
    storeLanes(steps_, steps + most - least);
    steps_[0] = steps[0];
    storeLanes(mostBelow_, most);
    storeLanes(leastBelow_, least);
    levels_ = kLevelKinds[place_].data();
  }

  // The indices of four z, 16 bits each, next to each other.
  std::uint64_t packHalf(const std::int16_t* indices) const {
    std::uint64_t all;
    std::memcpy(&all, indices, sizeof all);
    const std::uint32_t bits = brick_.bits;
    all = (all | all >> (16 - bits)) & 0x0000ffff0000ffff;
    return (all | all >> (32 - 2 * bits)) & 0xffffffff;
  }
  void packRow() {
    const std::uint64_t packed = packHalf(row_ + 1) | packHalf(row_ + 5) << (4 * brick_.bits);
    std::memcpy(payload_, &packed, brick_.bits);
  }
  // The reverse, of the low bits.
  std::uint64_t unpackHalf(std::uint64_t packed) const {
    const std::uint32_t bits = brick_.bits;
    packed &= (std::uint64_t{1} << 4 * bits) - 1;
    const std::uint64_t pair = (std::uint64_t{1} << 2 * bits) - 1;
    packed = (packed | packed << (32 - 2 * bits)) & (pair << 32 | pair);
    return (packed | packed << (16 - bits)) & greatest_ * 0x0001000100010001;
  }
  // All that an encoder's row needs, eight z at once: steps_ and sums_ become what contexts are made of.
  void prepareRow() {
    using Halves = std::uint64_t __attribute__((vector_size(16)));
    const auto indices = reinterpret_cast<Lanes>(Halves{unpackHalf(packed_), unpackHalf(packed_ >> (4 * brick_.bits))});
    storeLanes(row_ + 1, indices);
    const Lanes before = __builtin_shufflevector(indices, Lanes{}, 8, 0, 1, 2, 3, 4, 5, 6);
    const Lanes none{};
    Lanes steps = loadLanes(steps_);
    const std::int16_t first = steps[0];
    steps += 2 * larger(larger(before - loadLanes(mostBelow_), loadLanes(leastBelow_) - before), none);
    steps[0] = first;
    storeLanes(steps_, smaller(steps, none + static_cast<std::int16_t>(kMostSteps)));
    Lanes eighths = (loadLanes(sums_) + before * static_cast<std::int16_t>(weight_)) >> 3;
    eighths = smaller(larger(eighths, none), none + static_cast<std::int16_t>(most_));
    storeLanes(sums_, eighths);
    const auto unused = static_cast<std::int16_t>(16 - brick_.bits);
    const Lanes difference = ((indices - ((eighths + 4) >> 3)) << unused) >> unused;
    storeLanes(numbers_, (difference << 1) ^ (difference >> 15));
  }

  VoxelBrick brick_;
  std::uint32_t greatest_;  // index
  std::int32_t most_;       // the same in eighths
  const std::uint16_t* edges_;
  std::int16_t values_[9][10][kRow];  // [x + 1][y + 1], the last y repeated

  // Of the row at hand.
  std::uint32_t place_;
  std::byte* payload_;
  std::int16_t* row_;
  const std::int16_t *left_, *behind_;
  const LevelKinds* levels_;
  std::int32_t weight_;  // of the voxel at z - 1, in 64ths
  std::int16_t sums_[8], steps_[8];
  std::int16_t mostBelow_[8], leastBelow_[8];  // of left and behind at z - 1
  std::int32_t before_;
  std::uint64_t packed_;  // what an encoder codes
  std::int16_t numbers_[8];
};

template <class Tokens>
[[gnu::always_inline]] inline void codeRows(Tokens& tokens, BrickRows& one, std::uint32_t oneCoded, BrickRows& other,
                                            std::uint32_t otherCoded) {
  if ((oneCoded & otherCoded) == 0xff) {
    tokens.beginVoxels();
    one.codeVoxel<true>(tokens, 0);
    other.codeVoxel<true>(tokens, 0);
    for (std::uint32_t z = 1; z < 8; ++z) {
      if (z == 4) tokens.beginVoxels();
      one.codeVoxel<false>(tokens, z);
      other.codeVoxel<false>(tokens, z);
    }
    return;
  }
  for (std::uint32_t z = 0; z < 8; ++z) {
    tokens.beginVoxels();
    for (const auto& [rows, coded] : {std::pair(&one, oneCoded), std::pair(&other, otherCoded)}) {
      if ((coded >> z & 1) == 0) {
        rows->skipVoxel();
      } else if (z == 0) {
        rows->template codeVoxel<true>(tokens, z);
      } else {
        rows->template codeVoxel<false>(tokens, z);
      }
    }
  }
}

template <class Tokens>
void codeBricks(Tokens& tokens, std::span<const VoxelBrick> bricks) {
  static constexpr std::uint8_t kNone[64] = {};
  BrickRows one, other;
  std::byte nothing[64];
  for (std::size_t i = 0; i < bricks.size(); i += 2) {
    one.begin(bricks[i]);
    other.begin(i + 1 < bricks.size() ? bricks[i + 1] : VoxelBrick{nothing, kNone, 1});
    for (std::uint32_t x = 0; x < 8; ++x) {
      for (std::uint32_t y = 0; y < 8; ++y) {
        tokens.beginVoxels();
        const std::uint32_t oneCoded = one.beginRow(tokens, x, y);
        const std::uint32_t otherCoded = other.beginRow(tokens, x, y);
        if ((oneCoded | otherCoded) != 0) codeRows(tokens, one, oneCoded, other, otherCoded);
        one.endRow<Tokens>(y);
        other.endRow<Tokens>(y);
      }
    }
  }
}

}  // namespace

template <>
void VoxelModel::code(Encoder& coder, std::span<const VoxelBrick> bricks) {
  if (bricks.empty()) return;
  TokenRecorder tokens(bricks.size());
  codeBricks(tokens, bricks);
  tables_.code(coder, tokens.counts());
  tokens.replay(coder.rans(), tables_);
}

template <>
void VoxelModel::code(Decoder& coder, std::span<const VoxelBrick> bricks) {
  if (bricks.empty()) return;
  tables_.code(coder, {});
  TokenReader tokens(coder.rans(), tables_);
  codeBricks(tokens, bricks);
  coder.rans() = tokens.rans();
}

}  // namespace billow::format::page_coder
