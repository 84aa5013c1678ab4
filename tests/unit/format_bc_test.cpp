// BC7 blocks built bit by bit, in the order of the specification's fields, against values computed by hand.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <utility>

#include "billow/format/bc7_tables.h"
#include "billow/format/brick.h"

namespace {

using namespace billow::format;

using Block = std::array<std::byte, 16>;
using Rgba = std::array<int, 4>;

// Fields as (value, bits), least significant first.
Block makeBlock(std::initializer_list<std::pair<std::uint32_t, std::uint32_t>> fields) {
  Block block{};
  std::uint32_t position = 0;
  for (const auto& [value, bits] : fields) {
    for (std::uint32_t i = 0; i < bits; ++i, ++position) {
      if ((value >> i & 1u) != 0) block[position >> 3] |= std::byte{1} << (position & 7);
    }
  }
  EXPECT_LE(position, 128u);
  return block;
}

std::array<Rgba, 16> decode(const Block& block) {
  std::uint8_t rgba[16][4];
  decodeBc7Block(block.data(), rgba);
  std::array<Rgba, 16> texels;
  for (std::size_t i = 0; i < 16; ++i) texels[i] = {rgba[i][0], rgba[i][1], rgba[i][2], rgba[i][3]};
  return texels;
}

TEST(Bc7, mode0) {
  // Partition 0 of three subsets. Ends: four bits and a p-bit, five bits widened: 31 -> 255, 30 -> 247, 1 -> 8.
  const auto texels = decode(makeBlock({
      {1, 1}, {0, 4},  {15, 4}, {0, 4}, {15, 4}, {0, 4}, {0, 4}, {15, 4},  // R of subsets 0, 0, 1, 1, 2, 2
      {0, 4}, {0, 4},  {0, 4},  {0, 4}, {0, 4},  {0, 4},                   // G
      {0, 4}, {15, 4}, {0, 4},  {0, 4}, {0, 4},  {0, 4},                   // B
      {1, 1}, {0, 1},  {0, 1},  {1, 1}, {0, 1},  {0, 1},                   // p
      {0, 2}, {7, 3},  {0, 3},  {0, 2},  // texels 0, 1, 2 and 3, the anchor of subset 1
      {0, 3}, {0, 3},  {7, 3},  {1, 3}, {0, 3},  {0, 3}, {7, 3}, {7, 3},  {0, 3}, {0, 3}, {0, 3}, {0, 2},
  }));
  EXPECT_EQ(texels[0], (Rgba{255, 8, 8, 255}));  // subset 0, first end, p = 1
  EXPECT_EQ(texels[1], (Rgba{0, 0, 247, 255}));  // subset 0, second end, p = 0
  EXPECT_EQ(texels[2], (Rgba{247, 0, 0, 255}));  // subset 1, first end, p = 0
  EXPECT_EQ(texels[6], (Rgba{8, 8, 8, 255}));    // subset 1, second end, p = 1
  // Weight 9 of 64: (55 * 247 + 9 * 8 + 32) >> 6 = 213; (55 * 0 + 9 * 8 + 32) >> 6 = 1.
  EXPECT_EQ(texels[7], (Rgba{213, 1, 1, 255}));
  EXPECT_EQ(texels[9], (Rgba{0, 0, 0, 255}));     // subset 2, first end
  EXPECT_EQ(texels[10], (Rgba{247, 0, 0, 255}));  // subset 2, second end
}

TEST(Bc7, mode1) {
  // Partition 13: texels 8 to 15 are subset 1, anchor 15. Ends: six bits and a p-bit for both ends of a subset.
  const auto texels = decode(makeBlock({
      {2, 2}, {13, 6}, {63, 6}, {0, 6}, {0, 6}, {63, 6}, {32, 6}, {32, 6}, {0, 6}, {0, 6}, {0, 6},
      {0, 6}, {1, 6},  {1, 6},  {1, 1}, {0, 1}, {0, 2},  {7, 3},  {3, 3},  {0, 3}, {0, 3}, {0, 3},
      {0, 3}, {0, 3},  {0, 3},  {7, 3}, {0, 3}, {0, 3},  {0, 3},  {0, 3},  {0, 3}, {3, 2},
  }));
  EXPECT_EQ(texels[0], (Rgba{255, 131, 2, 255}));  // 65 of seven bits: 130 | 1
  EXPECT_EQ(texels[1], (Rgba{2, 131, 2, 255}));
  EXPECT_EQ(texels[2], (Rgba{148, 131, 2, 255}));  // weight 27: (37 * 255 + 27 * 2 + 32) >> 6
  EXPECT_EQ(texels[8], (Rgba{0, 0, 4, 255}));
  EXPECT_EQ(texels[9], (Rgba{253, 0, 4, 255}));   // 126 of seven bits: 252 | 1
  EXPECT_EQ(texels[15], (Rgba{107, 0, 4, 255}));  // weight 27 of 253: 106.7
}

TEST(Bc7, mode2) {
  // Partition 8 of three subsets: rows 0 and 1, row 2, row 3; anchors 0, 8 and 15. Ends of five bits, no p-bit.
  const auto texels = decode(makeBlock({
      {4, 3}, {8, 6},  {31, 5}, {0, 5},  {1, 5}, {31, 5}, {16, 5}, {16, 5}, {0, 5}, {0, 5}, {0, 5}, {0, 5},
      {0, 5}, {31, 5}, {0, 5},  {31, 5}, {0, 5}, {0, 5},  {0, 5},  {0, 5},  {1, 1}, {3, 2}, {0, 2}, {2, 2},
      {0, 2}, {0, 2},  {0, 2},  {0, 2},  {0, 1}, {3, 2},  {0, 2},  {0, 2},  {3, 2}, {0, 2}, {0, 2}, {1, 1},
  }));
  EXPECT_EQ(texels[0], (Rgba{171, 0, 84, 255}));  // weight 21: (43 * 255 + 32) >> 6 and (21 * 255 + 32) >> 6
  EXPECT_EQ(texels[1], (Rgba{0, 0, 255, 255}));
  EXPECT_EQ(texels[3], (Rgba{84, 0, 171, 255}));
  EXPECT_EQ(texels[8], (Rgba{8, 0, 0, 255}));
  EXPECT_EQ(texels[9], (Rgba{255, 0, 0, 255}));
  EXPECT_EQ(texels[12], (Rgba{132, 255, 0, 255}));
  EXPECT_EQ(texels[15], (Rgba{132, 84, 0, 255}));
}

TEST(Bc7, mode3) {
  // Partition 17: texels 1, 2, 3 and 7 are subset 1, anchor 2. Ends of seven bits and a p-bit.
  const auto texels = decode(makeBlock({
      {8, 4}, {17, 6},  {127, 7}, {0, 7}, {10, 7}, {20, 7}, {0, 7}, {0, 7}, {0, 7}, {0, 7}, {5, 7}, {5, 7},
      {0, 7}, {127, 7}, {0, 1},   {1, 1}, {1, 1},  {0, 1},  {0, 1}, {3, 2}, {1, 1}, {0, 2}, {3, 2}, {0, 2},
      {0, 2}, {0, 2},   {0, 2},   {0, 2}, {0, 2},  {0, 2},  {0, 2}, {0, 2}, {0, 2}, {2, 2},
  }));
  EXPECT_EQ(texels[0], (Rgba{254, 0, 10, 255}));
  EXPECT_EQ(texels[4], (Rgba{1, 1, 11, 255}));
  EXPECT_EQ(texels[15], (Rgba{84, 1, 11, 255}));  // weight 43: (21 * 254 + 43 * 1 + 32) >> 6
  EXPECT_EQ(texels[1], (Rgba{40, 0, 254, 255}));
  EXPECT_EQ(texels[3], (Rgba{21, 1, 1, 255}));
  EXPECT_EQ(texels[2], (Rgba{27, 1, 84, 255}));  // weight 21
}

TEST(Bc7, mode4) {
  for (const std::uint32_t selector : {0u, 1u}) {
    // Rotation 2: alpha and green change places.
    const auto texels = decode(makeBlock({
        {16, 5}, {2, 2}, {selector, 1}, {31, 5}, {0, 5}, {0, 5}, {0, 5}, {0, 5}, {31, 5}, {63, 6}, {1, 6},
        {0, 1},  {3, 2}, {1, 2},        {0, 2},  {0, 2}, {0, 2}, {0, 2}, {0, 2}, {0, 2},  {0, 2},  {0, 2},
        {0, 2},  {0, 2}, {0, 2},        {0, 2},  {0, 2}, {0, 2}, {0, 3}, {0, 3}, {7, 3},  {1, 3},  {0, 3},
        {0, 3},  {0, 3}, {0, 3},        {0, 3},  {0, 3}, {0, 3}, {0, 3}, {0, 3}, {0, 3},  {0, 3},
    }));
    EXPECT_EQ(texels[0], (Rgba{255, 255, 0, 0}));
    if (selector == 0) {
      EXPECT_EQ(texels[1], (Rgba{0, 255, 255, 0}));
      EXPECT_EQ(texels[2], (Rgba{171, 255, 84, 0}));
      EXPECT_EQ(texels[3], (Rgba{255, 4, 0, 0}));
      EXPECT_EQ(texels[4], (Rgba{255, 220, 0, 0}));  // weight 9: (55 * 255 + 9 * 4 + 32) >> 6
    } else {
      EXPECT_EQ(texels[1], (Rgba{255, 4, 0, 0}));
      EXPECT_EQ(texels[2], (Rgba{255, 173, 0, 0}));  // weight 21: (43 * 255 + 21 * 4 + 32) >> 6
      EXPECT_EQ(texels[3], (Rgba{0, 255, 255, 0}));
      EXPECT_EQ(texels[4], (Rgba{219, 255, 36, 0}));
    }
  }
}

TEST(Bc7, mode5) {
  // Rotations 0 to 3: alpha stays, or changes places with red, green or blue.
  const Rgba first[4] = {{254 + 1, 0, 2, 200}, {200, 0, 2, 255}, {255, 200, 2, 0}, {255, 0, 200, 2}};
  for (std::uint32_t rotation = 0; rotation < 4; ++rotation) {
    const auto texels = decode(makeBlock({
        {32, 6}, {rotation, 2}, {127, 7}, {0, 7}, {0, 7}, {127, 7}, {1, 7}, {1, 7}, {200, 8}, {100, 8}, {0, 1},
        {3, 2},  {1, 2},        {0, 2},   {0, 2}, {0, 2}, {0, 2},   {0, 2}, {0, 2}, {0, 2},   {0, 2},   {0, 2},
        {0, 2},  {0, 2},        {0, 2},   {0, 2}, {0, 1}, {0, 2},   {3, 2}, {1, 2}, {0, 2},   {0, 2},   {0, 2},
        {0, 2},  {0, 2},        {0, 2},   {0, 2}, {0, 2}, {0, 2},   {0, 2}, {0, 2}, {0, 2},
    }));
    EXPECT_EQ(texels[0], first[rotation]) << rotation;
    if (rotation == 0) {
      EXPECT_EQ(texels[1], (Rgba{0, 255, 2, 200}));
      EXPECT_EQ(texels[2], (Rgba{171, 84, 2, 100}));
      EXPECT_EQ(texels[3], (Rgba{255, 0, 2, 167}));  // weight 21: (43 * 200 + 21 * 100 + 32) >> 6
    }
  }
}

TEST(Bc7, mode6) {
  const auto texels = decode(makeBlock({
      {64, 7}, {127, 7}, {0, 7}, {0, 7},  {127, 7}, {64, 7}, {64, 7}, {0, 7},  {10, 7},
      {0, 1},  {1, 1},   {0, 3}, {15, 4}, {1, 4},   {2, 4},  {3, 4},  {4, 4},  {5, 4},
      {6, 4},  {7, 4},   {8, 4}, {9, 4},  {10, 4},  {11, 4}, {12, 4}, {13, 4}, {14, 4},
  }));
  EXPECT_EQ(texels[0], (Rgba{254, 0, 128, 0}));
  EXPECT_EQ(texels[1], (Rgba{1, 255, 129, 21}));
  // In 64ths: 0 4 9 13 17 21 26 30 34 38 43 47 51 55 60 64.
  const int weights[] = {4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60};
  for (std::size_t i = 0; i < 14; ++i) {
    const int w = weights[i];
    EXPECT_EQ(texels[i + 2], (Rgba{(254 * (64 - w) + w + 32) / 64, (255 * w + 32) / 64,
                                   (128 * (64 - w) + 129 * w + 32) / 64, (21 * w + 32) / 64}));
  }
}

TEST(Bc7, mode7) {
  // Partition 34: a checkerboard, texels 1, 3, 4, 6, 9, 11, 12 and 14 are subset 1, anchor 6.
  const std::uint32_t partition = 34;
  const std::uint32_t anchor = bc7Anchor(kBc7Anchors2, partition);
  ASSERT_EQ(anchor, 6u);
  const auto texels = decode(makeBlock({
      {128, 8}, {partition, 6}, {31, 5}, {0, 5}, {0, 5},  {31, 5}, {0, 5}, {0, 5}, {0, 5}, {0, 5},
      {16, 5},  {16, 5},        {0, 5},  {0, 5}, {31, 5}, {31, 5}, {0, 5}, {0, 5}, {1, 1}, {0, 1},
      {0, 1},   {1, 1},         {0, 1},  {0, 2}, {3, 2},  {3, 2},  {1, 2}, {0, 2}, {1, 1}, {0, 2},
      {0, 2},   {0, 2},         {0, 2},  {0, 2}, {0, 2},  {0, 2},  {0, 2}, {0, 2},
  }));
  EXPECT_EQ(texels[0], (Rgba{255, 4, 134, 255}));  // 33 of six bits: 132 | 2
  EXPECT_EQ(texels[2], (Rgba{0, 0, 130, 251}));    // 62 of six bits: 248 | 3
  EXPECT_EQ(texels[1], (Rgba{0, 0, 0, 0}));
  EXPECT_EQ(texels[3], (Rgba{255, 4, 4, 4}));
  EXPECT_EQ(texels[4], (Rgba{84, 1, 1, 1}));  // weight 21
  EXPECT_EQ(texels[6], (Rgba{84, 1, 1, 1}));  // the anchor, one bit
}

TEST(Bc7, reservedModeIsZero) {
  Block block;
  block.fill(std::byte{0xff});
  block[0] = std::byte{0};
  for (const Rgba& texel : decode(block)) EXPECT_EQ(texel, (Rgba{0, 0, 0, 0}));
}

TEST(Bc7, anchorsLieInTheirSubsets) {
  for (std::uint32_t p = 0; p < 64; ++p) {
    EXPECT_EQ(kBc7Partitions2[p] & 1u, 0u) << p;
    EXPECT_EQ(kBc7Partitions2[p] >> bc7Anchor(kBc7Anchors2, p) & 1u, 1u) << p;
    EXPECT_EQ(kBc7Partitions3[p] & 3u, 0u) << p;
    EXPECT_EQ(kBc7Partitions3[p] >> 2 * bc7Anchor(kBc7Anchors3Second, p) & 3u, 1u) << p;
    EXPECT_EQ(kBc7Partitions3[p] >> 2 * bc7Anchor(kBc7Anchors3Third, p) & 3u, 2u) << p;
  }
}

// 64-bit FNV-1a over all texels of pseudo-random blocks. The constant is what an independent decoder (Pillow's) gave
// for the same blocks.
TEST(Bc7, randomBlocksOfEveryModeDecodeAsEver) {
  std::uint64_t state = 0x9e3779b97f4a7c15u;
  std::uint64_t digest = 0xcbf29ce484222325u;
  for (std::uint32_t n = 0; n < 8 * 4096; ++n) {
    Block block;
    for (std::byte& b : block) {
      state = state * 6364136223846793005u + 1442695040888963407u;
      b = static_cast<std::byte>(state >> 56);
    }
    const std::uint32_t mode = n % 8;
    block[0] = static_cast<std::byte>((std::to_integer<std::uint32_t>(block[0]) << (mode + 1) | 1u << mode) & 0xff);
    std::uint8_t rgba[16][4];
    decodeBc7Block(block.data(), rgba);
    for (const auto& texel : rgba) {
      for (const std::uint8_t value : texel) digest = (digest ^ value) * 0x100000001b3u;
    }
  }
  EXPECT_EQ(digest, 1992903762698235123u);
}

}  // namespace
