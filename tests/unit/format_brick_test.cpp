// From stored bytes to values: the order of texels in every encoding, masks, and the reconstruction rule.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "billow/format/brick.h"
#include "sample_pack.h"

namespace {

using namespace billow;
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

// By bits of N, lowest first, as the standard puts it: not by decodeIndex.
std::uint32_t bitsAt(std::span<const std::byte> bytes, std::uint32_t first, std::uint32_t count) {
  std::uint32_t value = 0;
  for (std::uint32_t b = 0; b < count; ++b) {
    value |= (std::to_integer<std::uint32_t>(bytes[(first + b) / 8]) >> (first + b) % 8 & 1u) << b;
  }
  return value;
}

TEST(Brick, uniformTexelsAreIndicesInVoxelOrder) {
  for (const std::uint32_t bits : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 16u}) {
    const std::vector<std::byte> bytes = tests::randomBytes(64 * bits, bits);
    Texels texels;
    decodeTexels(uniformEncoding(bits), bytes, texels);
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) ASSERT_EQ(texels[i], bitsAt(bytes, i * bits, bits)) << bits;
    std::vector<std::byte> packed(bytes.size());
    packIndices(texels, bits, packed.data());
    EXPECT_EQ(packed, bytes) << bits;
  }
}

TEST(Brick, localTexelsLieBetweenTheEndsOfTheirCell) {
  for (std::uint32_t bits = 2; bits <= 6; ++bits) {
    const std::uint32_t last = (1u << bits) - 1;
    const std::vector<std::byte> bytes = tests::randomBytes(32 + 64 * bits, bits);
    Texels texels;
    decodeTexels(localEncoding(bits), bytes, texels);
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
      const std::uint32_t x = i / 64, y = i / 8 % 8, z = i % 8;
      const std::uint32_t cell = x / 4 * 8 + y / 4 * 4 + z / 2;
      const std::uint32_t base = bitsAt(bytes, 16 * cell, 8), top = bitsAt(bytes, 16 * cell + 8, 8);
      const std::uint32_t index = bitsAt(bytes, 256 + i * bits, bits);
      ASSERT_EQ(texels[i], base * (last - index) + top * index) << bits << ' ' << i;
      EXPECT_EQ(decodeIndex(localEncoding(bits), bytes, i), index);
    }
  }
}

TEST(Brick, coarseTexelsAreLinearBetweenMiddles) {
  const std::vector<std::byte> bytes = tests::randomBytes(64, 11);
  Texels texels;
  decodeTexels(kEncodingCoarse, bytes, texels);
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    const std::uint32_t voxel[] = {i / 64, i / 8 % 8, i % 8};
    double sum = 0;
    for (std::uint32_t c = 0; c < 64; ++c) {
      const std::uint32_t at[] = {c / 16, c / 4 % 4, c % 4};
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) {
        // Value X stands at 2 X + 0.5; beyond the first and the last it stays.
        const double place = std::clamp(static_cast<double>(voxel[axis]), 0.5, 6.5);
        weight *= std::max(0.0, 1 - std::abs(place - (2.0 * at[axis] + 0.5)) / 2);
      }
      sum += weight * static_cast<double>(bytes[c]);
    }
    ASSERT_EQ(texels[i], 64 * sum) << i;
  }
}

TEST(Brick, oneVoxelIsWhatAllAre) {
  for (std::uint32_t encoding = 0; encoding < kEncodingCount; ++encoding) {
    const std::vector<std::byte> bytes = tests::randomBytes(*brickBytes(encoding), encoding);
    Texels texels;
    decodeTexels(encoding, bytes, texels);
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
      ASSERT_EQ(decodeTexel(encoding, bytes, i >> 6, i >> 3 & 7, i & 7), texels[i]) << encoding << ' ' << i;
      ASSERT_LE(texels[i], largestTexel(encoding)) << encoding;
    }
  }
}

TEST(Brick, theLargestTexelIsReached) {
  for (std::uint32_t encoding = kEncodingUniform1; encoding < kEncodingCount; ++encoding) {
    const std::vector<std::byte> ones(*brickBytes(encoding), std::byte{255});
    Texels texels;
    decodeTexels(encoding, ones, texels);
    EXPECT_EQ(texels[77], largestTexel(encoding)) << encoding;
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
  decodeBrick(makeNode(kEncodingUniform8, kMaskAll, 1.0f, 0.5f), nullptr, bytes, -1.0f, values, active);
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    EXPECT_EQ(values[i], 2.5f);
    EXPECT_TRUE(maskBit(active, i));
  }
}

TEST(Brick, indexMaskIsWhereTheIndexIsNotZero) {
  for (std::uint32_t encoding = kEncodingUniform1; encoding <= kEncodingLocal6; ++encoding) {
    // Ends of 0 in every cell: a texel of 0 does not make a voxel inactive.
    std::vector<std::byte> bytes(*brickBytes(encoding));
    const std::uint32_t bits = indexBits(encoding);
    const std::uint32_t bit = (isLocal(encoding) ? 256 : 0) + voxelIndex(5, 1, 2) * bits + bits - 1;
    bytes[bit / 8] |= std::byte{1} << bit % 8;
    Values values;
    Mask3 active;
    decodeBrick(makeNode(encoding, kMaskTexel, 1.0f, 2.0f), nullptr, bytes, -4.0f, values, active);
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
      const bool on = i == voxelIndex(5, 1, 2);
      const float texel = isLocal(encoding) ? 0.0f : static_cast<float>(1u << (bits - 1));
      EXPECT_EQ(values[i], on ? 1.0f + 2.0f * texel : -4.0f) << encoding << ' ' << i;
      EXPECT_EQ(maskBit(active, i), on) << encoding << ' ' << i;
    }
  }
}

TEST(Brick, indexedMaskHidesTexels) {
  const std::vector<std::byte> bytes(512, std::byte{1});
  Mask3 mask{};
  mask.words[0] = 2;
  Values values;
  Mask3 active;
  decodeBrick(makeNode(kEncodingUniform8, 12345, 0.0f, 1.0f), &mask, bytes, 9.0f, values, active);
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
  const std::uint32_t bytes[] = {0,   128, 128,  128, 64,  128, 192, 256, 320, 384,
                                 448, 512, 1024, 160, 224, 288, 352, 416, 64};
  const std::uint32_t axes[] = {2, 2, 1, 0};
  ASSERT_EQ(std::size(bytes), kEncodingCount);
  for (std::uint32_t encoding = 0; encoding < kEncodingCount; ++encoding) {
    EXPECT_EQ(brickBytes(encoding), bytes[encoding]);
    EXPECT_EQ(brickUnits(encoding), bytes[encoding] / 32);
    EXPECT_EQ(packedAxis(encoding), encoding < 4 ? axes[encoding] : 2);
  }
  EXPECT_EQ(brickBytes(kEncodingCount), std::nullopt);
  EXPECT_EQ(brickUnits(kEncodingCount), 0u);
  EXPECT_EQ(encodingOf({0x7abcdef0u, 0, 0, 0, 0}), 15u);
  EXPECT_EQ(unitOf({0x7abcdef0u, 0, 0, 0, 0}), 0x2bcdef0u);
}

}  // namespace
