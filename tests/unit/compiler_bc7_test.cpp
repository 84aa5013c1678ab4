// BC7 bricks: what is promised is what the reader reconstructs, effort pays, every build writes the same bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "brick_corpus.h"
#include "brick_source.h"
#include "encode/bc7_block.h"
#include "stages.h"

namespace {

using namespace billow;
using compiler::Candidate;
using tests::Brick;
using tests::makeBrick;
using tests::sourceOf;

constexpr int kLastEffort = 9;

// Where about that many voxels of eight are active.
std::function<bool(std::uint32_t)> share(std::uint32_t eighths) {
  return [=](std::uint32_t i) { return tests::hash(i, 7, eighths) % 8 < eighths; };
}

std::vector<Brick> noise() {
  std::vector<Brick> bricks;
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const auto value = [=](auto x, auto y, auto z) {
      const float random = tests::randomValue(seed, format::voxelIndex(x, y, z));
      return static_cast<float>(x * y) * 0.1f + random * static_cast<float>(seed % 4) * 3.0f;
    };
    bricks.push_back(makeBrick(value, share(seed % 3 == 0 ? 8 : 1 + seed % 8)));
  }
  return bricks;
}

std::vector<Brick> extremes() {
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr float kDenormal = std::numeric_limits<float>::denorm_min();
  const auto parity = [](std::uint32_t x, std::uint32_t y, std::uint32_t z) { return ((x ^ y ^ z) & 1u) != 0; };
  std::vector<Brick> bricks;
  for (const std::uint32_t eighths : {0u, 1u, 4u, 8u}) {
    const auto add = [&](const auto& value) { bricks.push_back(makeBrick(value, share(eighths))); };
    add([](auto...) { return 0.3f; });
    add([](auto x, auto...) { return x < 4 ? -kLargest : kLargest; });
    add([](auto x, auto...) { return x < 3 ? 0.0f : kDenormal; });
    add([&](auto x, auto y, auto z) { return parity(x, y, z) ? 1.0f : 0.0f; });
    add([](auto x, auto y, auto z) { return x + y + z == 0 ? 1e6f : 0.001f; });
    add([](auto x, auto y, auto z) { return 1e-40f * tests::randomValue(4, format::voxelIndex(x, y, z)); });
    add([](auto x, auto y, auto z) { return 3e38f * tests::randomValue(5, format::voxelIndex(x, y, z)); });
  }
  return bricks;
}

// Decodes as a reader would, and holds the candidate to its word.
void checkPromise(const Brick& brick, const Candidate& candidate) {
  format::Texels texels;
  format::decodeTexels(candidate.encoding, std::span(candidate.payload).first(128), texels);
  double squared = 0, largest = 0;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (!format::maskBit(brick.active, i)) continue;
    const float value = format::reconstruct(candidate.lo, candidate.scale, texels[i]);
    ASSERT_TRUE(std::isfinite(value)) << i;
    const double error = static_cast<double>(value) - static_cast<double>(brick.values[i]);
    squared += error * error;
    largest = std::max(largest, std::abs(error));
  }
  EXPECT_NEAR(candidate.squaredError, squared, 1e-12 * squared);
  const double highest = std::numeric_limits<float>::max();
  // The next float at or above it.
  EXPECT_GE(static_cast<double>(candidate.maxError), std::min(largest, highest));
  EXPECT_LE(static_cast<double>(std::nextafter(candidate.maxError, 0.0f)), std::min(largest, highest));
  EXPECT_TRUE(std::isfinite(candidate.lo));
  EXPECT_TRUE(std::isfinite(candidate.scale));
  EXPECT_GE(candidate.scale, 0.0f);
  EXPECT_FALSE(candidate.texelMask);
}

TEST(Bc7, whatIsPromisedIsWhatIsDecoded) {
  std::vector<Brick> bricks = noise();
  for (const Brick& brick : extremes()) bricks.push_back(brick);
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    for (int effort = 0; effort <= kLastEffort; ++effort) {
      SCOPED_TRACE(std::to_string(b) + " at effort " + std::to_string(effort));
      Candidate candidate;
      compiler::encodeBc7BestAxis(sourceOf(bricks[b]), effort, candidate);
      checkPromise(bricks[b], candidate);
      const std::uint32_t encoding = format::kEncodingBc7Z + static_cast<std::uint32_t>(effort) % 3;
      compiler::encodeBc7(sourceOf(bricks[b]), encoding, effort, candidate);
      EXPECT_EQ(candidate.encoding, encoding);
      checkPromise(bricks[b], candidate);
    }
  }
}

TEST(Bc7, oneValueIsExact) {
  for (const std::uint32_t eighths : {1u, 8u}) {
    const Brick brick = makeBrick([](auto...) { return -5.3f; }, share(eighths));
    for (int effort = 0; effort <= kLastEffort; ++effort) {
      Candidate candidate;
      compiler::encodeBc7BestAxis(sourceOf(brick), effort, candidate);
      EXPECT_EQ(candidate.squaredError, 0.0) << effort;
    }
  }
}

// Solving for lo and scale reaches between the texels that the range of the values allows.
TEST(Bc7, rangeIsSolvedWithTheBlocks) {
  const Brick brick = makeBrick([](auto x, auto y, auto z) { return tests::randomValue(x, 8 * y + z); });
  Candidate given, solved;
  compiler::encodeBc7(sourceOf(brick), format::kEncodingBc7Z, 3, given);
  compiler::encodeBc7(sourceOf(brick), format::kEncodingBc7Z, 4, solved);
  EXPECT_NE(given.scale, solved.scale);
  EXPECT_LT(solved.squaredError, given.squaredError);
}

double totalError(const std::vector<Brick>& bricks, int effort) {
  double total = 0;
  Candidate candidate;
  for (const Brick& brick : bricks) {
    compiler::encodeBc7BestAxis(sourceOf(brick), effort, candidate);
    total += candidate.squaredError;
  }
  return total;
}

TEST(Bc7, effortPays) {
  // Smooth and rough bricks apart: the errors of the latter would hide those of the former.
  const std::vector<Brick> cloud = tests::cloudBricks(40);
  const std::vector<Brick> rough = noise();
  double before[2] = {1e300, 1e300};
  for (int effort = 0; effort <= kLastEffort; ++effort) {
    const double total[2] = {totalError(cloud, effort), totalError(rough, effort)};
    EXPECT_LT(total[0], before[0]) << effort;
    EXPECT_LT(total[1], before[1]) << effort;
    std::copy_n(total, 2, before);
  }
}

TEST(Bc7, smoothCloudReachesItsPsnr) {
  const std::vector<Brick> bricks = tests::cloudBricks(128);
  float highest = 0;
  std::uint64_t voxels = 0;
  for (const Brick& brick : bricks) {
    voxels += brick.activeCount;
    for (const float value : brick.values) highest = std::max(highest, value);
  }
  const auto psnr = [&](double squared) {
    return 20 * std::log10(static_cast<double>(highest) / std::sqrt(squared / static_cast<double>(voxels)));
  };
  EXPECT_GT(psnr(totalError(bricks, 0)), 47.0);
  EXPECT_GT(psnr(totalError(bricks, 1)), 48.2);
  EXPECT_GT(psnr(totalError(bricks, 3)), 48.6);
}

TEST(Bc7, everyModeIsUsed) {
  std::uint32_t used[8] = {};
  std::vector<Brick> bricks = tests::cloudBricks(48);
  for (const Brick& brick : noise()) bricks.push_back(brick);
  // One slice in four unlike the others, the others smooth: what modes 4 and 5 are for.
  for (std::uint32_t seed = 0; seed < 4; ++seed) {
    bricks.push_back(makeBrick([=](auto x, auto y, auto z) {
      const float random = tests::randomValue(seed, format::voxelIndex(x, y, z));
      return (z & 3) == seed ? random : static_cast<float>(x + y) / 16.0f;
    }));
  }
  Candidate candidate;
  for (const Brick& brick : bricks) {
    compiler::encodeBc7(sourceOf(brick), format::kEncodingBc7Z, 3, candidate);
    for (std::size_t b = 0; b < 8; ++b) {
      ++used[std::countr_zero(std::to_integer<std::uint8_t>(candidate.payload[16 * b]))];
    }
  }
  for (const int mode : {0, 1, 2, 3}) EXPECT_EQ(used[mode], 0u) << mode;
  for (const int mode : {4, 5, 6, 7}) EXPECT_GT(used[mode], 0u) << mode;
}

// Eight blocks of noise, of smooth texels, or of both mixed; every third time all count.
compiler::BlockTexels blocksOf(std::uint32_t seed) {
  compiler::BlockTexels texels;
  texels.allActive = seed % 3 == 0;
  for (std::uint32_t c = 0; c < 4; ++c) {
    for (std::uint32_t i = 0; i < 16; ++i) {
      for (std::uint32_t b = 0; b < 8; ++b) {
        const float noise = tests::randomValue(seed, 512 * b + 16 * c + i);
        const float smooth = static_cast<float>((i & 3) + (i >> 2) + c) / 9.0f;
        const float share = static_cast<float>(b) / 7.0f;
        texels.value[c][i][b] = 255.0f * (share * noise + (1 - share) * smooth);
        texels.weight[c][i][b] = texels.allActive || tests::hash(seed, 16 * c + i, b) % 4 != 0 ? 1.0f : 0.0f;
      }
    }
  }
  return texels;
}

// What the decoder makes of a block against what it should be.
double decodedError(const compiler::Bc7Fits& fits, std::uint32_t block, const compiler::BlockTexels& texels) {
  std::byte bytes[16];
  compiler::packBlock(fits, block, bytes);
  std::uint8_t rgba[16][4];
  format::decodeBc7Block(bytes, rgba);
  double squared = 0;
  for (std::uint32_t i = 0; i < 16; ++i) {
    for (std::uint32_t c = 0; c < 4; ++c) {
      const double error = rgba[i][c] - static_cast<double>(texels.value[c][i][block]);
      squared += error * error * static_cast<double>(texels.weight[c][i][block]);
    }
  }
  return squared;
}

// The search minimises what the decoder will give, not an approximation of it, in each mode.
TEST(Bc7, errorOfAFitIsThatOfItsBlock) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    const compiler::BlockTexels texels = blocksOf(seed);
    const compiler::Bc7Search search = compiler::bc7Search(static_cast<int>(seed % 10));
    compiler::Bc7Fits fits[3];
    compiler::fitMode6(texels, search, fits[0]);
    fits[1] = fits[2] = fits[0];
    for (std::uint32_t b = 0; b < 8; ++b) fits[1].error[b] = fits[2].error[b] = 1e30f;
    if (search.rotations > 0) compiler::tryModes4And5(texels, search, fits[1]);
    if (search.partitions > 0) compiler::tryMode7(texels, search, fits[2]);
    for (const compiler::Bc7Fits& fit : fits) {
      for (std::uint32_t b = 0; b < 8; ++b) {
        if (fit.error[b] >= 1e30f) continue;
        const double squared = decodedError(fit, b, texels);
        EXPECT_NEAR(static_cast<double>(fit.error[b]), squared, 1e-4 * squared + 1e-4) << seed << ' ' << fit.mode[b];
      }
    }
  }
}

// 64-bit FNV-1a over everything that reaches a pack, for a fixed set of bricks. gcc, clang, debug, release and any CPU
// must agree on it; it changes only when the encoder is changed on purpose.
TEST(Bc7, everyBuildWritesTheSameBytes) {
  std::vector<Brick> bricks = tests::cloudBricks(32);
  for (const Brick& brick : noise()) bricks.push_back(brick);
  std::uint64_t digest = 0xcbf29ce484222325u;
  const auto add = [&](const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) digest = (digest ^ bytes[i]) * 0x100000001b3u;
  };
  Candidate candidate;
  for (const Brick& brick : bricks) {
    for (int effort = 0; effort <= kLastEffort; ++effort) {
      compiler::encodeBc7BestAxis(sourceOf(brick), effort, candidate);
      add(&candidate.encoding, sizeof candidate.encoding);
      add(&candidate.lo, sizeof candidate.lo);
      add(&candidate.scale, sizeof candidate.scale);
      add(&candidate.squaredError, sizeof candidate.squaredError);
      add(&candidate.maxError, sizeof candidate.maxError);
      add(candidate.payload.data(), 128);
    }
  }
  EXPECT_EQ(digest, 17085031133602093108u);
}

}  // namespace
