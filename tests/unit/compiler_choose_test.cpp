// The choose stage: the error asked for holds, and nothing cheaper is passed over.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "choose/decide.h"

namespace billow::compiler {
namespace {

constexpr float kNoLimit = std::numeric_limits<float>::infinity();

using Options = std::vector<std::vector<Choice>>;

double errorOf(const Options& bricks, const std::vector<std::uint32_t>& chosen) {
  double sum = 0;
  for (std::size_t b = 0; b < bricks.size(); ++b) sum += bricks[b][chosen[b]].squaredError;
  return sum;
}

std::uint32_t bytesOf(const Options& bricks, const std::vector<std::uint32_t>& chosen) {
  std::uint32_t sum = 0;
  for (std::size_t b = 0; b < bricks.size(); ++b) sum += bricks[b][chosen[b]].bytes;
  return sum;
}

Options randomOptions(std::mt19937& random, std::size_t bricks) {
  Options options(bricks);
  for (auto& brick : options) {
    double error = std::exp2(static_cast<double>(random() % 16));
    for (const std::uint32_t bytes : {0u, 128u, 256u, 512u}) {
      brick.push_back({bytes, error, static_cast<float>(std::sqrt(error))});
      error /= static_cast<double>(1 + random() % 32);
    }
  }
  return options;
}

// Fewest bytes that meet the budget, by trying every combination.
std::uint32_t exhaustive(const Options& bricks, double budget) {
  std::uint32_t best = ~0u;
  const std::uint32_t combinations = 1u << (2 * bricks.size());
  for (std::uint32_t code = 0; code < combinations; ++code) {
    std::vector<std::uint32_t> chosen(bricks.size());
    for (std::size_t b = 0; b < bricks.size(); ++b) chosen[b] = code >> (2 * b) & 3;
    if (errorOf(bricks, chosen) <= budget) best = std::min(best, bytesOf(bricks, chosen));
  }
  return best;
}

TEST(Allocate, MeetsTheBudgetWithinOneStepOfTheBest) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    const Options bricks = randomOptions(random, 5);
    const double budget = std::exp2(static_cast<double>(random() % 14));
    const auto chosen = allocate(bricks, budget, kNoLimit);
    const std::uint32_t best = exhaustive(bricks, budget);
    if (!chosen) {
      EXPECT_EQ(best, ~0u);
      continue;
    }
    EXPECT_LE(errorOf(bricks, chosen->chosen), budget);
    EXPECT_GE(bytesOf(bricks, chosen->chosen), best);
    EXPECT_LE(bytesOf(bricks, chosen->chosen), best + 512);
  }
}

TEST(Allocate, TakesNoChoiceAboveTheLargestError) {
  std::mt19937 random(8);
  Options bricks = randomOptions(random, 100);
  for (auto& brick : bricks) brick.push_back({1024, 0.0, 0.0f});
  const auto chosen = allocate(bricks, 1e30, 4.0f);
  ASSERT_TRUE(chosen.has_value());
  for (std::size_t b = 0; b < bricks.size(); ++b) EXPECT_LE(bricks[b][chosen->chosen[b]].maxError, 4.0f);
}

TEST(Allocate, SaysWhenNothingReachesTheError) {
  const Options bricks = {{{0, 10.0, 3.0f}, {128, 5.0, 2.0f}}};
  EXPECT_FALSE(allocate(bricks, 4.0, kNoLimit).has_value());
  EXPECT_FALSE(allocate(bricks, 100.0, 1.0f).has_value());
  EXPECT_TRUE(allocate(bricks, 5.0, kNoLimit).has_value());
}

// A grid of noisy leaves with ragged masks.
ImportedGrid noisyGrid(std::uint32_t leaves) {
  std::mt19937 random(3);
  ImportedGrid grid;
  grid.present = true;
  for (std::uint32_t i = 0; i < leaves; ++i) {
    Leaf leaf{};
    leaf.origin = {static_cast<std::int32_t>(i) * 8, 0, 0};
    for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
      if (random() % 4 == 0) continue;
      leaf.active.words[v >> 5] |= 1u << (v & 31);
      leaf.values[v] = static_cast<float>(random() % 1000) * 1e-3f * static_cast<float>(i % 5);
      grid.max = std::max(grid.max, leaf.values[v]);
      ++grid.activeVoxels;
    }
    grid.leaves.push_back(leaf);
  }
  return grid;
}

double decodedError(const ImportedGrid& grid, const ChosenGrid& chosen) {
  double error = 0;
  for (std::size_t i = 0; i < grid.leaves.size(); ++i) {
    const ChosenBrick& brick = chosen.bricks[i];
    format::Node3 node{};
    node.brick = brick.encoding << format::kEncodingShift;
    node.mask = brick.texelMask ? format::kMaskTexel : 0;
    node.lo = brick.lo;
    node.scale = brick.scale;
    format::Values values;
    format::Mask3 active;
    format::decodeBrick(node, &grid.leaves[i].active, brick.payload, grid.background, values, active);
    for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
      EXPECT_EQ(format::maskBit(active, v), format::maskBit(grid.leaves[i].active, v));
      if (!format::maskBit(active, v)) continue;
      const double d = static_cast<double>(values[v]) - static_cast<double>(grid.leaves[i].values[v]);
      error += d * d;
    }
  }
  return error;
}

const auto kNowhere = [](std::size_t) { return std::string("test"); };

class ChoosePsnr : public testing::TestWithParam<double> {};

TEST_P(ChoosePsnr, IsKept) {
  const std::vector<ImportedGrid> grids = {noisyGrid(40)};
  Quality quality;
  quality.psnr = GetParam();
  const ChosenGrid chosen = chooseEncodings(grids, quality, kNowhere)[0];
  const double error = decodedError(grids[0], chosen);
  EXPECT_NEAR(error, chosen.squaredError, 1e-9 * error);
  const double rmse = std::sqrt(error / static_cast<double>(grids[0].activeVoxels));
  EXPECT_GE(20 * std::log10(static_cast<double>(grids[0].max) / rmse), GetParam());
}

INSTANTIATE_TEST_SUITE_P(Decibels, ChoosePsnr, testing::Values(20.0, 30.0, 45.0, 60.0, 80.0));

TEST(Choose, KeepsTheLargestError) {
  const std::vector<ImportedGrid> grids = {noisyGrid(20)};
  for (const float bound : {0.5f, 0.05f, 0.002f, 1e-4f}) {
    Quality quality;
    quality.psnr.reset();
    quality.maxError = bound;
    EXPECT_LE(chooseEncodings(grids, quality, kNowhere)[0].maxError, bound);
  }
}

TEST(Choose, ALowerMultiplierBuysLessErrorForMoreBytes) {
  const ImportedGrid grid = noisyGrid(40);
  std::uint64_t last = 0;
  double lastError = 1e30;
  for (const double multiplier : {1e-1, 1e-3, 1e-5, 1e-8}) {
    const Goal goal = goalAt({multiplier, {1, 0}}, {});
    GridTrials trials(grid, goal, 1, {});
    const ChosenGrid chosen = decide(grid, goal, trials, {}, {}, "test");
    std::uint64_t bytes = 0;
    for (const ChosenBrick& brick : chosen.bricks) bytes += brick.payload.size();
    const double error = decodedError(grid, chosen);
    EXPECT_NEAR(error, chosen.squaredError, 1e-9 * error);
    EXPECT_GT(bytes, last);
    EXPECT_LT(error, lastError);
    last = bytes;
    lastError = error;
  }
}

TEST(Choose, NamesWhatCannotBeReached) {
  const std::vector<ImportedGrid> grids = {noisyGrid(4)};
  Quality quality;
  quality.psnr = 150;
  try {
    chooseEncodings(grids, quality, kNowhere);
    FAIL() << "150 dB are out of 16 bits' reach";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_NE(std::string(error.what()).find("test: the error asked for is out of reach"), std::string::npos);
  }
}

}  // namespace
}  // namespace billow::compiler
