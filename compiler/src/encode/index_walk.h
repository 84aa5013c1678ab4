// A brick's indices in the order in which a page codes them, each with what the known ones foretell of it. The page
// coder predicts alike (spec/pagecodec.md, "Voxels"); what differs costs bytes, never soundness.
#ifndef BILLOW_COMPILER_ENCODE_INDEX_WALK_H
#define BILLOW_COMPILER_ENCODE_INDEX_WALK_H

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "billow/format/brick.h"

namespace billow::compiler {

// The indices that active voxels may have; inactive ones are 0.
struct IndexRange {
  std::int32_t first, last;
};

struct IndexGuess {
  std::int32_t eighths;  // of an index, within the range
  std::int32_t level;    // how uncertain: about eight times the size of usual misses
};

class IndexWalk {
 public:
  // pick(guess) says the index of the next active voxel, in the order of voxelIndex.
  template <class Pick>
  static void run(const format::Mask3& active, IndexRange range, const Pick& pick) {
    IndexWalk walk;
    for (std::uint32_t row = 0; row < 64; ++row) {
      const std::uint32_t bits = active.words[row >> 2] >> (8 * (row & 3)) & 255;
      walk.row(row >> 3, row & 7, bits, range, pick);
    }
  }

 private:
  using Row = std::int16_t[16];  // eighths of indices, z at z + 1; the ends are repeated before and after

  template <class Pick>
  void row(std::uint32_t x, std::uint32_t y, std::uint32_t active, IndexRange range, const Pick& pick) {
    Row& now = known_[x + 1][y + 1];
    if (active != 0) fill(now, x, y, active, range, pick);
    if (y == 7) std::memcpy(known_[x + 1][9], now, sizeof now);
  }

  template <class Pick>
  void fill(Row& now, std::uint32_t x, std::uint32_t y, std::uint32_t active, IndexRange range, const Pick& pick) {
    // 64ths of the voxel at z - 1; 256 / how many steps are summed. By place.
    static constexpr std::int32_t kBefore[4] = {56, 32, 32, 24};
    static constexpr std::int32_t kStepScale[4][2] = {{0, 128}, {64, 44}, {51, 37}, {37, 28}};
    const std::uint32_t place = 2u * (x > 0) + (y > 0);
    lookAhead(x, y, place);
    const Row& left = *left_;
    const Row& behind = *behind_;
    std::int32_t before = 0;
    for (std::uint32_t z = 0; z < 8; ++z) {
      std::int32_t index = 0;
      if ((active >> z & 1) != 0) {
        const bool inRow = z > 0;
        const std::int32_t sum = sums_[z] + (inRow ? kBefore[place] * before : 0);
        const std::int32_t steps = steps_[z] + (inRow ? std::abs(before - behind[z]) + std::abs(before - left[z]) : 0);
        const std::int32_t guessed = place != 0 || inRow ? sum >> 6 : 4 * range.last;
        const std::int32_t local = steps * kStepScale[place][inRow] >> 8;
        const IndexGuess guess{std::clamp(guessed, 8 * range.first, 8 * range.last), (3 * local + (miss_ >> 3)) >> 2};
        index = pick(guess);
        miss_ += std::min(std::abs(8 * index - guess.eighths), 255) - (miss_ >> 3);
      }
      before = 8 * index;
      now[z + 1] = static_cast<std::int16_t>(before);
    }
    now[0] = now[1];
    now[9] = now[8];
  }

  // What is known of a row before its first voxel: sums of weighted neighbours, and of steps between them.
  void lookAhead(std::uint32_t x, std::uint32_t y, std::uint32_t place) {
    // 64ths of: left (y - 1), behind (x - 1), corner (both), left at z - 1, behind at z - 1, corner at z - 1, behind at
    // z + 1, beside (x - 1, y + 1), left at z + 1. By place (x > 0, y > 0) and whether z > 0.
    static constexpr std::int32_t kWeights[4][2][9] = {
        {{0, 0, 0, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}},
        {{39, 0, 0, 0, 0, 0, 0, 0, 20}, {22, 0, 0, -5, 0, 0, 0, 0, 14}},
        {{0, 32, 0, 0, 0, 0, 15, 14, 0}, {0, 20, 0, 0, -6, 0, 12, 6, 0}},
        {{26, 19, -4, 0, 0, 0, 4, 12, 8}, {19, 16, -3, -3, -3, -3, 5, 7, 7}}};
    left_ = y > 0 ? &known_[x + 1][y] : &known_[x][y + 1];
    behind_ = x > 0 ? &known_[x][y + 1] : left_;
    const Row& left = *left_;
    const Row& behind = *behind_;
    const Row& beside = x > 0 ? known_[x][y + 2] : behind;
    const Row& corner = place == 3 ? known_[x][y] : behind;
    const auto sumAt = [&](const std::int32_t* w, std::uint32_t z) {
      return w[0] * left[z + 1] + w[1] * behind[z + 1] + w[2] * corner[z + 1] + w[3] * left[z] + w[4] * behind[z] +
             w[5] * corner[z] + w[6] * behind[z + 2] + w[7] * beside[z + 1] + w[8] * left[z + 2];
    };
    for (std::uint32_t z = 0; z < 8; ++z) {
      sums_[z] = sumAt(kWeights[place][1], z);
      steps_[z] = std::abs(left[z + 1] - left[z]) + std::abs(behind[z + 1] - behind[z]) +
                  std::abs(left[z + 1] - corner[z + 1]) + std::abs(behind[z + 1] - corner[z + 1]) +
                  std::abs(left[z + 2] - left[z + 1]) + std::abs(behind[z + 2] - behind[z + 1]) +
                  std::abs(beside[z + 1] - behind[z + 1]);
    }
    sums_[0] = sumAt(kWeights[place][0], 0);
  }

  Row known_[9][10] = {};  // [x + 1][y + 1], the last y repeated
  const Row* left_ = nullptr;
  const Row* behind_ = nullptr;
  std::int32_t sums_[8] = {}, steps_[8] = {};
  std::int32_t miss_ = 128;  // eight times the usual one, in eighths of an index
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_INDEX_WALK_H
