// From stored bytes to values: the order of texels in every encoding, masks, and the reconstruction rule.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "billow/format/brick.h"

namespace {

using namespace billow::format;

Node3 makeNode(std::uint32_t encoding, std::uint32_t mask, float lo = 0, float scale = 1) {
  return {encoding << kEncodingShift, mask, lo, scale, 0};
}

// Where the voxel (x, y, z) of a brick lies once its packed axis has changed places with z.
std::array<std::uint32_t, 3> stored(std::uint32_t encoding, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  switch (packedAxis(encoding)) {
    case 0:
      return {z, y, x};
    case 1:
      return {x, z, y};
    default:
      return {x, y, z};
  }
}

TEST(Brick, bc4VoxelsLieWhereTheSpecSays) {
  for (const std::uint32_t encoding : {kEncodingBc4Z, kEncodingBc4Y, kEncodingBc4X}) {
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
      const auto [x, y, z] = stored(encoding, i >> 6, i >> 3 & 7, i & 7);
      // Ends 0 and 0 with palette entry 7 at one texel: that one is 255, every other 0.
      std::vector<std::byte> bytes(256);
      std::byte* block = &bytes[((z * 2 + y / 4) * 2 + x / 4) * 8];
      const std::uint32_t bit = 16 + 3 * (y % 4 * 4 + x % 4);
      for (std::uint32_t b = bit; b < bit + 3; ++b) block[b / 8] |= std::byte{1} << b % 8;
      Texels texels;
      decodeTexels(encoding, bytes, texels);
      for (std::uint32_t j = 0; j < kBrickVoxels; ++j) ASSERT_EQ(texels[j], i == j ? 255 : 0) << encoding << ' ' << i;
    }
  }
}

TEST(Brick, bc7VoxelsLieWhereTheSpecSays) {
  for (const std::uint32_t encoding : {kEncodingBc7Z, kEncodingBc7Y, kEncodingBc7X}) {
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
      const auto [x, y, z] = stored(encoding, i >> 6, i >> 3 & 7, i & 7);
      // Mode 5, colour 0, alpha from 0 to 255 moved to channel z & 3; the texel's two alpha bits (one for texel 0)
      // are 1 of 3, which is 84.
      std::vector<std::byte> bytes(128);
      for (std::uint32_t b = 0; b < 8; ++b) bytes[16 * b] = std::byte{32};
      std::byte* block = &bytes[((z / 4 * 2 + y / 4) * 2 + x / 4) * 16];
      const std::uint32_t rotation = (z & 3) == 3 ? 0 : (z & 3) + 1;
      block[0] |= static_cast<std::byte>(rotation << 6);
      const auto set = [&](std::uint32_t bit) { block[bit / 8] |= std::byte{1} << bit % 8; };
      for (std::uint32_t b = 0; b < 8; ++b) set(50 + 8 + b);
      const std::uint32_t texel = y % 4 * 4 + x % 4;
      set(97 + (texel == 0 ? 0 : 2 * texel - 1));
      Texels texels;
      decodeTexels(encoding, bytes, texels);
      for (std::uint32_t j = 0; j < kBrickVoxels; ++j) ASSERT_EQ(texels[j], i == j ? 84 : 0) << encoding << ' ' << i;
    }
  }
}

TEST(Brick, rawTexelsHaveXFastest) {
  std::vector<std::byte> bytes(1024);
  for (std::uint32_t i = 0; i < 512; ++i) {
    bytes[i] = static_cast<std::byte>(i & 0xff);
    bytes[512 + i] = static_cast<std::byte>(i >> 8 | 0x80);
  }
  Texels r8, r16;
  decodeTexels(kEncodingR8, std::span(bytes).first(512), r8);
  decodeTexels(kEncodingR16, bytes, r16);
  for (std::uint32_t x = 0; x < 8; ++x) {
    for (std::uint32_t y = 0; y < 8; ++y) {
      for (std::uint32_t z = 0; z < 8; ++z) {
        const std::uint32_t at = z * 64 + y * 8 + x;
        EXPECT_EQ(r8[voxelIndex(x, y, z)], at & 0xff);
        EXPECT_EQ(r16[voxelIndex(x, y, z)], at | 0x8000);
      }
    }
  }
}

TEST(Brick, constantIsLoWhereActiveAndTheBackgroundElsewhere) {
  Mask3 mask{};
  mask.words[3] = 0x80000001u;
  Values values;
  Mask3 active;
  decodeBrick(makeNode(kEncodingConstant, 0, 2.5f, 100.0f), &mask, {}, 0.25f, values, active);
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    const bool on = i == 96 || i == 127;
    EXPECT_EQ(values[i], on ? 2.5f : 0.25f) << i;
    EXPECT_EQ(maskBit(active, i), on) << i;
  }
}

TEST(Brick, maskAllNeedsNoMask) {
  const std::vector<std::byte> bytes(512, std::byte{3});
  Values values;
  Mask3 active;
  decodeBrick(makeNode(kEncodingR8, kMaskAll, 1.0f, 0.5f), nullptr, bytes, -1.0f, values, active);
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    EXPECT_EQ(values[i], 2.5f);
    EXPECT_TRUE(maskBit(active, i));
  }
}

TEST(Brick, texelMaskIsWhereTheTexelIsNotZero) {
  std::vector<std::byte> bytes(1024);
  bytes[5] = std::byte{7};             // x = 5, y = 0, z = 0
  bytes[512 + 64 * 2] = std::byte{1};  // the high byte alone, of (0, 0, 2)
  for (const std::uint32_t encoding : {kEncodingR8, kEncodingR16}) {
    Values values;
    Mask3 active;
    decodeBrick(makeNode(encoding, kMaskTexel, 1.0f, 2.0f), nullptr, std::span(bytes).first(*brickBytes(encoding)),
                -4.0f, values, active);
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
      float expected = -4.0f;
      if (i == voxelIndex(5, 0, 0)) expected = 15.0f;
      if (encoding == kEncodingR16 && i == voxelIndex(0, 0, 2)) expected = 513.0f;
      EXPECT_EQ(values[i], expected) << encoding << ' ' << i;
      EXPECT_EQ(maskBit(active, i), expected != -4.0f) << encoding << ' ' << i;
    }
  }
}

TEST(Brick, indexedMaskHidesTexels) {
  const std::vector<std::byte> bytes(512, std::byte{1});
  Mask3 mask{};
  mask.words[0] = 2;
  Values values;
  Mask3 active;
  decodeBrick(makeNode(kEncodingR8, 12345, 0.0f, 1.0f), &mask, bytes, 9.0f, values, active);
  EXPECT_EQ(values[0], 9.0f);
  EXPECT_EQ(values[1], 1.0f);
  EXPECT_EQ(values[2], 9.0f);
  EXPECT_EQ(active.words[0], 2u);
}

TEST(Brick, reconstructRoundsTheProductBeforeTheSum) {
  // 3 * (1 + 2^-23) lies half-way between floats and rounds to even, 3 + 2^-21; a fused multiply-add would keep 3 *
  // 2^-23.
  const float scale = 1.0f + std::numeric_limits<float>::epsilon();
  const float fused = std::fma(scale, 3.0f, -3.0f);
  const float expected = std::ldexp(1.0f, -21);
  ASSERT_NE(fused, expected);
  EXPECT_EQ(reconstruct(-3.0f, scale, 3), expected);
  EXPECT_EQ(reconstruct(1.5f, 0.0f, 65535), 1.5f);
  EXPECT_EQ(reconstruct(0.0f, 0.25f, 65535), 16383.75f);
}

TEST(Brick, sizesAndAxes) {
  const std::uint32_t bytes[] = {0, 128, 128, 128, 256, 256, 256, 512, 1024};
  const std::uint32_t axes[] = {2, 2, 1, 0, 2, 1, 0, 2, 2};
  for (std::uint32_t encoding = 0; encoding < kEncodingCount; ++encoding) {
    EXPECT_EQ(brickBytes(encoding), bytes[encoding]);
    EXPECT_EQ(brickUnits(encoding), bytes[encoding] / 64);
    EXPECT_EQ(packedAxis(encoding), axes[encoding]);
  }
  EXPECT_EQ(brickBytes(kEncodingCount), std::nullopt);
  EXPECT_EQ(brickUnits(kEncodingCount), 0u);
  EXPECT_EQ(encodingOf({0x7abcdef0u, 0, 0, 0, 0}), 15u);
  EXPECT_EQ(unitOf({0x7abcdef0u, 0, 0, 0, 0}), 0x2bcdef0u);
}

}  // namespace
