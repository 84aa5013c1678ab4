// --metric depth: the error of line integrals that was asked for holds in the finished grid.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>

#include "choose/choose.h"
#include "choose/decide.h"
#include "choose/depth_goal.h"
#include "metric/depth_distortion.h"
#include "metric/depth_error.h"

namespace billow::compiler {
namespace {

// A cloud with noise, thin at its rim: every voxel inside a ball of 20 voxels.
ImportedGrid cloud() {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> noise(0, 0.2f);
  ImportedGrid grid;
  grid.present = true;
  for (std::int32_t x = -24; x < 24; x += 8) {
    for (std::int32_t y = -24; y < 24; y += 8) {
      for (std::int32_t z = -24; z < 24; z += 8) {
        Leaf leaf{{x, y, z}, {}, {}};
        bool any = false;
        for (std::int32_t i = 0; i < 512; ++i) {
          const auto at = [](std::int32_t v) { return static_cast<float>(v) + 0.5f; };
          const float px = at(x + i / 64), py = at(y + i / 8 % 8), pz = at(z + i % 8);
          const float depth = 1 - (px * px + py * py + pz * pz) / 400;
          if (depth <= 0) continue;
          any = true;
          leaf.active.words[i / 32] |= 1u << (i % 32);
          leaf.values[static_cast<std::size_t>(i)] = depth * (1 + noise(random));
          grid.max = std::max(grid.max, leaf.values[static_cast<std::size_t>(i)]);
        }
        if (any) grid.leaves.push_back(leaf);
      }
    }
  }
  return grid;
}

ImportedGrid decoded(const ImportedGrid& source, const ChosenGrid& chosen) {
  ImportedGrid result = source;
  for (std::size_t i = 0; i < source.leaves.size(); ++i) {
    const ChosenBrick& brick = chosen.bricks[i];
    format::Node3 node{};
    node.brick = brick.encoding << format::kEncodingShift;
    node.mask = brick.texelMask ? format::kMaskTexel : 0;
    node.lo = brick.lo;
    node.scale = brick.scale;
    format::Mask3 active;
    format::decodeBrick(node, &source.leaves[i].active, brick.payload, source.background, result.leaves[i].values,
                        active);
  }
  return result;
}

ChosenGrid choose(const ImportedGrid& grid, double psnr, Metric metric) {
  Quality quality;
  quality.psnr = psnr;
  quality.metric = metric;
  return chooseEncodings({&grid, 1}, quality, [](std::size_t) { return std::string("grid"); }).at(0);
}

std::size_t bytesOf(const ChosenGrid& grid) {
  std::size_t bytes = 0;
  for (const ChosenBrick& brick : grid.bricks) bytes += brick.payload.size();
  return bytes;
}

TEST(DepthGoal, HoldsInTheFinishedGrid) {
  const ImportedGrid grid = cloud();
  for (const double psnr : {40.0, 55.0, 65.0, 75.0}) {
    const ImportedGrid result = decoded(grid, choose(grid, psnr, Metric::depth));
    EXPECT_GE(measureDepth(grid, result).psnr(), psnr);
  }
}

TEST(DepthGoal, NoVoxelIsOffByMoreThanATwentiethOfTheRange) {
  const ImportedGrid grid = cloud();
  const ChosenGrid chosen = choose(grid, 20, Metric::depth);  // which alone would allow constants
  EXPECT_LE(chosen.maxError, 0.05f * grid.max);
  EXPECT_GT(chosen.maxError, 0);
}

// Errors without pattern average out along lines, so the same figure costs fewer bytes in depth than in voxels.
TEST(DepthGoal, CostsLessThanTheSamePsnrOfVoxels) {
  const ImportedGrid grid = cloud();
  EXPECT_LT(bytesOf(choose(grid, 50, Metric::depth)), bytesOf(choose(grid, 50, Metric::voxel)));
}

// The grid with the least error by the metric that has at most so many bytes of payload.
ChosenGrid within(const ImportedGrid& grid, std::size_t bytes, Metric metric) {
  Quality quality;
  quality.psnr.reset();
  quality.metric = metric;
  ChosenGrid best;
  double low = -60, high = 20;  // octaves of the multiplier
  for (int round = 0; round < 12; ++round) {
    const double middle = (low + high) / 2;
    const Goal goal = goalAt({std::exp2(middle), {1, 0}}, quality);
    GridTrials trials(grid, goal, quality.effort, {});
    ChosenGrid chosen = decide(grid, goal, trials, {}, {}, "grid");
    const bool fits = bytesOf(chosen) <= bytes;
    (fits ? high : low) = middle;
    if (fits) best = std::move(chosen);
  }
  return best;
}

TEST(DepthGoal, BytesSpentByItServeDepthBetterThanBytesSpentByVoxels) {
  const ImportedGrid grid = cloud();
  for (const std::size_t bytes : {std::size_t{12000}, std::size_t{20000}}) {
    const double byVoxel = measureDepth(grid, decoded(grid, within(grid, bytes, Metric::voxel))).psnr();
    const double byDepth = measureDepth(grid, decoded(grid, within(grid, bytes, Metric::depth))).psnr();
    EXPECT_GE(byDepth, byVoxel);
    EXPECT_GT(byVoxel, 30);
  }
}

TEST(DepthGoal, ReportsTheErrorOfVoxels) {
  const ImportedGrid grid = cloud();
  const ChosenGrid chosen = choose(grid, 55, Metric::depth);
  const ImportedGrid result = decoded(grid, chosen);
  double squared = 0;
  for (std::size_t l = 0; l < grid.leaves.size(); ++l) {
    for (std::size_t i = 0; i < 512; ++i) {
      const double error =
          static_cast<double>(result.leaves[l].values[i]) - static_cast<double>(grid.leaves[l].values[i]);
      squared += error * error;
    }
  }
  EXPECT_NEAR(chosen.squaredError, squared, 1e-4 * squared);
}

TEST(DepthGoal, AConstantGridIsExact) {
  ImportedGrid grid;
  grid.present = true;
  grid.leaves.push_back({{0, 0, 0}, {}, {}});
  std::fill(std::begin(grid.leaves[0].active.words), std::end(grid.leaves[0].active.words), ~0u);
  EXPECT_EQ(choose(grid, 60, Metric::depth).squaredError, 0);
}

TEST(DepthGoal, DistortionIsThatOfTheDecodedBrick) {
  const ImportedGrid grid = cloud();
  const Leaf& leaf = grid.leaves[grid.leaves.size() / 2];
  const BrickSource source{&leaf.values, &leaf.active, 512, 0};
  Candidate candidate;
  encodeUniform(source, 3, candidate);
  ChosenGrid one;
  one.bricks.push_back({});
  one.bricks[0].encoding = candidate.encoding;
  one.bricks[0].texelMask = candidate.texelMask;
  one.bricks[0].lo = candidate.lo;
  one.bricks[0].scale = candidate.scale;
  one.bricks[0].payload.assign(candidate.payload.begin(),
                               candidate.payload.begin() + *format::brickBytes(candidate.encoding));
  ImportedGrid alone;
  alone.leaves.push_back(leaf);
  const double expected = measureDepth(alone, decoded(alone, one)).squaredError;
  EXPECT_GT(expected, 0);
  EXPECT_NEAR(DepthGoal::distortion(source, candidate), expected, 1e-5 * expected);
}

}  // namespace
}  // namespace billow::compiler
