// What the disk's bytes are foretold to be, and bricks that are made to take few.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <memory>
#include <random>

#include "choose/disk_estimate.h"
#include "choose/trials.h"
#include "encode/encode_for_disk.h"
#include "encode/error_sums.h"
#include "encode/index_bits.h"

namespace billow::compiler {
namespace {

TEST(IndexBits, LogarithmIsNearTheTrueOne) {
  for (const std::uint32_t value : {1u, 2u, 3u, 7u, 100u, 511u, 512u, 70000u, 0xffffffffu}) {
    EXPECT_NEAR(log2In256ths(value) / 256.0, std::log2(static_cast<double>(value)), 0.01) << value;
  }
}

TEST(IndexBits, ProbabilitiesSumToOne) {
  for (const IndexRange range : {IndexRange{0, 1}, {1, 3}, {0, 7}, {1, 22}, {1, 63}}) {
    for (std::int32_t eighths = 8 * range.first; eighths <= 8 * range.last; eighths += 3) {
      for (const std::int32_t level : {0, 5, 30, 100}) {
        double sum = 0;
        for (std::int32_t i = range.first; i <= range.last; ++i) {
          sum += std::exp2(-static_cast<double>(indexBits256({eighths, level}, range, i)) / 256);
        }
        EXPECT_NEAR(sum, 1, 0.04) << range.last << " " << eighths << " " << level;
      }
    }
  }
}

TEST(IndexBits, AnywhereInRangeIsDefined) {
  for (const std::int32_t level : {0, 1 << 20}) {
    for (const std::int32_t index : {0, 255}) {
      EXPECT_LT(indexBits256({index == 0 ? 8 * 255 : 0, level}, {0, 255}, index), 64u * 256);
    }
  }
}

struct Brick {
  format::Values values{};
  format::Mask3 active{};
  std::uint32_t count = 0;

  BrickSource source() const { return {&values, &active, count, 0}; }
};

// A slope with noise of so many times its step from voxel to voxel; every `hole`th voxel is inactive.
Brick noisy(float noise, std::uint32_t hole) {
  Brick brick;
  std::mt19937 random(7);
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    if (v % hole == hole - 1) continue;
    brick.active.words[v >> 5] |= 1u << (v & 31);
    ++brick.count;
    const auto slope = static_cast<float>((v >> 6) + (v >> 3 & 7) + (v & 7));
    brick.values[v] = slope + noise * static_cast<float>(random() % 4096) / 4096;
  }
  return brick;
}

TEST(DiskEstimate, NoiseCostsMoreThanASlope) {
  Candidate candidate;
  const Brick slope = noisy(0.01f, 1000), noise = noisy(40, 1000);
  encodeUniform(slope.source(), 6, candidate);
  const std::uint32_t ofSlope = estimateDiskBytes(candidate, slope.active, false);
  encodeUniform(noise.source(), 6, candidate);
  const std::uint32_t ofNoise = estimateDiskBytes(candidate, noise.active, false);
  EXPECT_LT(3 * ofSlope, 2 * ofNoise);
  EXPECT_NEAR(ofNoise, noise.count * 5.5 / 8, 0.15 * ofNoise);  // nearly all of the range is noise
}

double decodedError(const Brick& brick, const Candidate& candidate, double& largest) {
  format::Node3 node{};
  node.brick = candidate.encoding << format::kEncodingShift;
  node.mask = candidate.texelMask ? format::kMaskTexel : 0;
  node.lo = candidate.lo;
  node.scale = candidate.scale;
  format::Values values;
  format::Mask3 active;
  format::decodeBrick(node, &brick.active, {candidate.payload.data(), *format::brickBytes(candidate.encoding)}, 0,
                      values, active);
  double sum = 0;
  largest = 0;
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    EXPECT_EQ(format::maskBit(active, v), format::maskBit(brick.active, v));
    if (!format::maskBit(active, v)) continue;
    const double error = static_cast<double>(values[v]) - static_cast<double>(brick.values[v]);
    sum += error * error;
    largest = std::max(largest, std::fabs(error));
  }
  return sum;
}

TEST(EncodeForDisk, MeasuresWhatReadersDecodeAndUsesNoHigherIndex) {
  for (const std::uint32_t hole : {3u, 1000u}) {
    for (const float noise : {0.0f, 1.0f, 30.0f, 1e30f}) {
      const Brick brick = noisy(noise, hole);
      for (const std::uint32_t last : {2u, 5u, 11u, 100u, 255u}) {
        Candidate candidate;
        encodeUniformForDisk(brick.source(), {last, 0}, candidate);
        EXPECT_EQ(format::indexBits(candidate.encoding), static_cast<std::uint32_t>(std::bit_width(last)));
        double largest = 0;
        const double squared = decodedError(brick, candidate, largest);
        EXPECT_NEAR(candidate.squaredError, squared, 1e-9 * squared);
        EXPECT_GE(static_cast<double>(candidate.maxError), largest);
        format::Texels indices;
        format::decodeTexels(candidate.encoding, candidate.payload, indices);
        for (const std::uint16_t index : indices) ASSERT_LE(index, last);
      }
    }
  }
}

TEST(EncodeForDisk, TradesErrorForBitsAtTheWorthGiven) {
  const Brick brick = noisy(3, 1000);
  Candidate exact, traded;
  const std::uint32_t exactBits = encodeUniformForDisk(brick.source(), {20, 1e-12}, exact);
  const double worth = 0.12 * static_cast<double>(exact.scale) * static_cast<double>(exact.scale);
  const std::uint32_t bits = encodeUniformForDisk(brick.source(), {20, worth}, traded);
  EXPECT_LT(bits, exactBits - exactBits / 50);
  EXPECT_LT(traded.squaredError + worth * bits / 256, exact.squaredError + worth * exactBits / 256);
}

TEST(EncodeForDisk, NoValueMovesBeyondTheLimitToSaveBits) {
  const Brick brick = noisy(3, 1000);
  Candidate exact, limited;
  encodeUniformForDisk(brick.source(), {20, 1e-12}, exact);
  encodeUniformForDisk(brick.source(), {20, 10, exact.maxError}, limited);
  EXPECT_LE(limited.maxError, 1.1f * exact.maxError);  // lo and scale are solved again after that
}

TEST(ErrorSums, TheLargestErrorIsRoundedUp) {
  EXPECT_EQ(roundUp(0), 0);
  EXPECT_EQ(roundUp(0.5), 0.5f);
  EXPECT_GT(static_cast<double>(roundUp(0.1)), 0.1 - 1e-12);
  EXPECT_GE(static_cast<double>(roundUp(0.7)), 0.7);  // to nearest it would be below
  EXPECT_EQ(roundUp(1e300), std::numeric_limits<float>::max());
  EXPECT_GT(roundUp(1e-60), 0);
}

// Where constants keep the error by far, nothing else is tried.
TEST(Trials, ALooseErrorTriesConstantsAlone) {
  ImportedGrid grid;
  grid.present = true;
  for (std::int32_t b = 0; b < 8; ++b) {
    const Brick brick = noisy(0.01f, 1000);
    grid.leaves.push_back({{8 * b, 0, 0}, brick.active, brick.values});
    grid.activeVoxels += format::kBrickVoxels;
  }
  grid.max = 22000;  // of the bricks' values 21
  Quality quality;
  quality.psnr = 47;
  const GridTrials trials(grid, goalOf(grid, quality), 1, {});
  for (const auto& choices : trials.choices()) EXPECT_EQ(choices.size(), 1u);
}

}  // namespace
}  // namespace billow::compiler
