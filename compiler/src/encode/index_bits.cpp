#include "encode/index_bits.h"

#include <array>
#include <bit>

namespace billow::compiler {
namespace {

// Fractional part of log2 of 1 + i / 256, in 1/256 bit: log2(y) of a y in [1, 2) bit by bit, by squaring.
constexpr std::array<std::uint8_t, 256> kLog2Fractions = [] {
  std::array<std::uint8_t, 256> table{};
  for (std::uint64_t i = 0; i < 256; ++i) {
    std::uint64_t y = (256 + i) << 22;  // 2^30 is 1
    std::uint32_t bits = 0;
    for (int b = 0; b < 8; ++b) {
      y = y * y >> 30;
      bits <<= 1;
      if (y >= std::uint64_t{2} << 30) {
        y >>= 1;
        bits |= 1;
      }
    }
    table[i] = static_cast<std::uint8_t>(bits);
  }
  return table;
}();

constexpr std::uint32_t log2Of(std::uint32_t value) {
  const auto whole = static_cast<std::uint32_t>(std::bit_width(value)) - 1;
  const std::uint32_t mantissa = whole >= 8 ? value >> (whole - 8) : value << (8 - whole);
  return whole << 8 | kLog2Fractions[mantissa & 255];
}

constexpr std::uint32_t kLevels = 13;
constexpr std::uint32_t kReach = 64;        // indices to either side of a guess that count
constexpr std::uint32_t kFar = 8 * kReach;  // in eighths
constexpr std::uint64_t kOne = 1ull << 32;

// Weights fall by these factors, in 2^-32, an eighth of an index: nearly all of the weight by the first, a share (in
// 1/1024) by the second. Fitted to the indices of six sequences of smoke and fire at 40 and 45 dB.
struct Fall {
  std::uint64_t near, far, share;
};
constexpr Fall kFalls[kLevels] = {
    {2610628452, 3991406307, 20}, {2991558232, 4097935128, 19}, {3536990014, 4224475251, 8},
    {3736719177, 4208036289, 13}, {3893377261, 4229236229, 14}, {4032423450, 4278254024, 5},
    {4115726589, 4287531130, 6},  {4178969259, 4287531130, 8},  {4220450917, 4287531130, 13},
    {4247229732, 4287531130, 16}, {4266038974, 4266038974, 0},  {4276401013, 4276401013, 0},
    {4280107838, 4280107838, 0},
};

std::uint32_t levelClass(std::int32_t level) {
  static constexpr auto kClasses = [] {
    std::array<std::uint8_t, 256> table{};
    for (std::int32_t i = 0; i < 256; ++i) {
      for (const std::int32_t bound : {2, 4, 7, 10, 14, 20, 28, 40, 56, 80, 112, 160}) {
        table[static_cast<std::size_t>(i)] =
            static_cast<std::uint8_t>(table[static_cast<std::size_t>(i)] + (i >= bound));
      }
    }
    return table;
  }();
  return kClasses[static_cast<std::size_t>(std::min(level, 255))];
}

struct Weights {
  std::array<std::uint32_t, kFar + 8> at;                     // by distance in eighths; the nearest is 2^20
  std::array<std::uint16_t, kFar + 8> log2;                   // of them
  std::array<std::array<std::uint32_t, kReach + 1>, 9> sums;  // [f][n]: of n distances f, f + 8, ...
};

constexpr std::array<Weights, kLevels> kWeights = [] {
  std::array<Weights, kLevels> levels{};
  for (std::size_t l = 0; l < kLevels; ++l) {
    Weights& weights = levels[l];
    const Fall& fall = kFalls[l];
    std::uint64_t near = kOne / 1024 * (1024 - fall.share);
    std::uint64_t far = kOne / 1024 * fall.share;
    for (std::size_t d = 0; d < weights.at.size(); ++d) {
      const std::uint64_t weight = (near + far) >> 12;
      weights.at[d] = weight > 0 ? static_cast<std::uint32_t>(weight) : 1;
      weights.log2[d] = static_cast<std::uint16_t>(log2Of(weights.at[d]));
      near = near * fall.near >> 32;
      far = far * fall.far >> 32;
    }
    for (std::size_t f = 0; f <= 8; ++f) {
      for (std::size_t n = 0; n < kReach; ++n) weights.sums[f][n + 1] = weights.sums[f][n] + weights.at[f + 8 * n];
    }
  }
  return levels;
}();

std::size_t reach(std::int32_t count) {
  return static_cast<std::size_t>(std::clamp(count, 0, static_cast<std::int32_t>(kReach)));
}

}  // namespace

std::uint32_t log2In256ths(std::uint32_t value) {
  return log2Of(value);
}

std::uint32_t indexBits256(const IndexGuess& guess, IndexRange range, std::int32_t index) {
  const Weights& weights = kWeights[levelClass(guess.level)];
  const std::int32_t floor = guess.eighths >> 3;
  const auto fraction = static_cast<std::size_t>(guess.eighths & 7);
  const std::uint32_t all =
      weights.sums[fraction][reach(floor - range.first + 1)] + weights.sums[8 - fraction][reach(range.last - floor)];
  const auto distance = static_cast<std::size_t>(std::abs(8 * index - guess.eighths));
  return log2Of(all) - weights.log2[std::min(distance, weights.log2.size() - 1)];
}

std::uint32_t indicesBits256(const format::Texels& indices, const format::Mask3& active, IndexRange range) {
  std::uint32_t bits = 0;
  std::uint32_t rows[16];
  std::copy(std::begin(active.words), std::end(active.words), rows);
  std::uint32_t word = 0;
  IndexWalk::run(active, range, [&](const IndexGuess& guess) {
    while (rows[word] == 0) ++word;
    const std::uint32_t voxel = word << 5 | static_cast<std::uint32_t>(std::countr_zero(rows[word]));
    rows[word] &= rows[word] - 1;
    bits += indexBits256(guess, range, indices[voxel]);
    return std::int32_t{indices[voxel]};
  });
  return bits;
}

}  // namespace billow::compiler
