// The indices of a brick of the uniform or local encoding, each predicted from its neighbours that are already known.
// spec/pagecodec.md, "Voxels".
#ifndef BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_MODEL_H
#define BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_MODEL_H

#include <algorithm>
#include <cstring>

#include "number_model.h"
#include "voxel_table.h"

namespace billow::format::page_coder {

// Values have 11 bits whatever the indices have. Of a cell of equal endpoints: the value of index i is values[i], and a
// value v stands at index (v - origin) * slope / 2^16, in eighths.
struct Cell {
  std::int32_t origin;
  std::int32_t slope;
  std::array<std::int16_t, 256> values;
};

// A brick's voxels as they are coded, one row of eight z after another.
struct VoxelRows {
  std::uint32_t bits;          // of an index, 1 to 8
  std::uint32_t least;         // the least index of an active voxel, 0 or 1
  const std::uint8_t* active;  // 64 rows; inactive voxels have index 0
  const Cell* const* cells;    // of row r and z: cells[4 r + (z >> 1)]
};

class VoxelModel {
 public:
  VoxelModel() {
    for (std::uint32_t i = 0; i < tokens_.size(); ++i) {
      tokens_[i] = modelOf(kVoxelTable[i / kLevels % kEdges][i % kLevels]);
    }
  }

  // `payload` holds the indices, `bits` each, the first in the low bits.
  template <class Coder>
  void code(Coder& coder, const VoxelRows& rows, std::byte* payload) {
    if constexpr (Coder::kDecodes) {
      Coder local = coder;  // a copy that nothing else can see stays in registers
      codeRows(local, rows, payload);
      coder = local;
    } else {
      codeRows(coder, rows, payload);
    }
  }

 private:
  static constexpr std::uint32_t kLevels = 13, kEdges = 8, kPlaces = 2;
  static constexpr std::int32_t kFirstLevel = 128;

  using Row = std::int16_t[16];  // z at z + 1, its ends repeated before and after

  // The class of a number: how many of the bounds it has reached.
  template <std::size_t kCount>
  static constexpr std::array<std::uint8_t, 256> classes(const std::uint8_t (&bounds)[kCount]) {
    std::array<std::uint8_t, 256> table{};
    for (std::uint32_t i = 0; i < table.size(); ++i) {
      for (const std::uint8_t bound : bounds) table[i] = static_cast<std::uint8_t>(table[i] + (i >= bound));
    }
    return table;
  }

  static std::uint32_t levelClass(std::int32_t level) {
    static constexpr auto kClasses = classes({2, 4, 7, 10, 14, 20, 28, 40, 56, 80, 112, 160});
    return kClasses[static_cast<std::size_t>(std::min(level, 255))];
  }

  static std::uint32_t edgeClass(std::int32_t eighths, std::int32_t most) {
    static constexpr auto kClasses = classes({6, 12, 24, 48, 96, 192});
    return eighths > most - 12 ? kEdges - 1 : kClasses[static_cast<std::size_t>(std::clamp(eighths, 0, 255))];
  }

  template <class Coder>
  [[gnu::always_inline]] void codeRows(Coder& coder, const VoxelRows& rows, std::byte* payload) {
    level_ = kFirstLevel;
    std::memset(values_, 0, sizeof values_);
    for (std::uint32_t x = 0; x < 8; ++x) {
      for (std::uint32_t y = 0; y < 8; ++y) codeRow(coder, rows, x, y, payload + (x << 3 | y) * rows.bits);
      std::memcpy(values_[x + 1][9], values_[x + 1][8], sizeof values_[0][0]);
    }
  }

  // What is known of a row before its first voxel: sums of weighted neighbours and of steps between them.
  struct Ahead {
    std::int32_t sum[8];
    std::int32_t steps[8];
  };

  static void lookAhead(const Row& left, const Row& behind, const Row& beside, const Row& corner, std::uint32_t place,
                        Ahead& ahead) {
    // 64ths of: left (y - 1), behind (x - 1), corner (both), left at z - 1, behind at z - 1, corner at z - 1, behind at
    // z + 1, beside (x - 1, y + 1), left at z + 1. By place (x > 0, y > 0) and whether z > 0.
    static constexpr std::int16_t kWeights[4][2][9] = {
        {{0, 0, 0, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}},
        {{39, 0, 0, 0, 0, 0, 0, 0, 20}, {22, 0, 0, -5, 0, 0, 0, 0, 14}},
        {{0, 32, 0, 0, 0, 0, 15, 14, 0}, {0, 20, 0, 0, -6, 0, 12, 6, 0}},
        {{26, 19, -4, 0, 0, 0, 4, 12, 8}, {19, 16, -3, -3, -3, -3, 5, 7, 7}}};
    const auto sumAt = [&](const std::int16_t* w, int z) {
      return w[0] * left[z + 1] + w[1] * behind[z + 1] + w[2] * corner[z + 1] + w[3] * left[z] + w[4] * behind[z] +
             w[5] * corner[z] + w[6] * behind[z + 2] + w[7] * beside[z + 1] + w[8] * left[z + 2];
    };
    for (int z = 0; z < 8; ++z) {
      ahead.sum[z] = sumAt(kWeights[place][1], z);
      ahead.steps[z] = std::abs(left[z + 1] - left[z]) + std::abs(behind[z + 1] - behind[z]) +
                       std::abs(left[z + 1] - corner[z + 1]) + std::abs(behind[z + 1] - corner[z + 1]) +
                       std::abs(left[z + 2] - left[z + 1]) + std::abs(behind[z + 2] - behind[z + 1]) +
                       std::abs(beside[z + 1] - behind[z + 1]);
    }
    ahead.sum[0] = sumAt(kWeights[place][0], 0);
  }

  template <class Coder>
  [[gnu::always_inline]] void codeRow(Coder& coder, const VoxelRows& rows, std::uint32_t x, std::uint32_t y,
                                      std::byte* payload) {
    static constexpr std::int32_t kBefore[4] = {56, 32, 32, 24};  // 64ths of the voxel at z - 1
    const std::uint32_t number = x << 3 | y;
    const std::uint32_t active = rows.active[number];
    Row& row = values_[x + 1][y + 1];
    if (active == 0) {
      if (Coder::kDecodes) std::memset(payload, 0, rows.bits);
      return;
    }
    const std::uint32_t place = 2u * (x > 0) + (y > 0);
    const Row& left = y > 0 ? values_[x + 1][y] : values_[x][y + 1];
    const Row& behind = x > 0 ? values_[x][y + 1] : left;
    Ahead ahead;
    lookAhead(left, behind, x > 0 ? values_[x][y + 2] : behind, place == 3 ? values_[x][y] : behind, place, ahead);
    std::uint64_t packed = 0;
    if (!Coder::kDecodes) std::memcpy(&packed, payload, rows.bits);
    std::uint64_t coded = 0;
    const std::uint32_t all = (1u << rows.bits) - 1;
    std::int32_t before = 0;
    for (std::uint32_t z = 0; z < 8; ++z) {
      const Cell& cell = *rows.cells[4 * number + (z >> 1)];
      std::uint32_t index = 0;
      if ((active >> z & 1) != 0) {
        const std::int32_t sum = ahead.sum[z] + (z > 0 ? kBefore[place] * before : 0);
        std::int32_t steps = ahead.steps[z];
        if (z > 0) steps += std::abs(before - behind[z]) + std::abs(before - left[z]);
        const Guess guess{place, z, sum, steps};
        index = codeVoxel(coder, rows, cell, guess, static_cast<std::uint32_t>(packed >> (z * rows.bits)) & all);
      }
      before = cell.values[index];
      row[z + 1] = static_cast<std::int16_t>(before);
      coded |= std::uint64_t{index} << (z * rows.bits);
    }
    row[0] = row[1];
    row[9] = row[8];
    if (Coder::kDecodes) std::memcpy(payload, &coded, rows.bits);
  }

  struct Guess {
    std::uint32_t place, z;
    std::int32_t sum, steps;
  };

  template <class Coder>
  [[gnu::always_inline]] std::uint32_t codeVoxel(Coder& coder, const VoxelRows& rows, const Cell& cell,
                                                 const Guess& guess, std::uint32_t index) {
    const std::int32_t most = 8 * ((1 << rows.bits) - 1);
    std::int32_t eighths = most / 2;
    const bool known = guess.place != 0 || guess.z != 0;
    if (known) {
      eighths = static_cast<std::int32_t>((std::int64_t{(guess.sum >> 6) - cell.origin} * cell.slope) >> 16);
    }
    const std::uint32_t edge = edgeClass(eighths, most);
    eighths = std::clamp(eighths, static_cast<std::int32_t>(8 * rows.least), most);
    const auto expected = static_cast<std::uint32_t>(eighths + 4) >> 3;
    const auto steps = static_cast<std::int32_t>((std::int64_t{guess.steps} * std::abs(cell.slope)) >> 16);
    const std::int32_t local = steps * kStepScale[guess.place][guess.z > 0] >> 8;
    const std::uint32_t level = levelClass((3 * local + (level_ >> 3)) >> 2);
    const std::uint32_t inside = guess.place == 3 && guess.z > 0;
    const std::uint32_t context = (inside * kEdges + edge) * kLevels + level;
    index = codeDifference(coder, tokens_[context], bits_[rows.bits - 1], rows.bits, expected, index);
    const std::int32_t miss = std::min(std::abs(8 * static_cast<std::int32_t>(index) - eighths), 255);
    level_ += miss - (level_ >> 3);
    return index;
  }

  // 256 / how many steps are summed
  static constexpr std::int32_t kStepScale[4][2] = {{0, 128}, {64, 44}, {51, 37}, {37, 28}};

  Row values_[9][10];  // [x + 1][y + 1], the last y repeated
  std::int32_t level_ = 0;
  std::array<SymbolModel, kPlaces * kEdges * kLevels> tokens_;
  std::array<ClassBits, 8> bits_;
};

}  // namespace billow::format::page_coder

#endif  // BILLOW_FORMAT_SRC_PAGE_CODER_VOXEL_MODEL_H
