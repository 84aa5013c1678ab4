// Budgets and what frames share with the frame before: whole compiles of small made sequences.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "billow/format/pack.h"
#include "choose/size_curve.h"
#include "compile.h"
#include "import/vdb_write.h"

namespace billow::compiler {
namespace {

constexpr std::int32_t kBricks = 6;  // along each axis

TEST(Ladder, PositionIsItsInverse) {
  for (double position = -200; position < 40; position += 0.37) {
    EXPECT_NEAR(positionOf(ladderMultiplier(position)), position, 1e-9);
    EXPECT_NEAR(std::log2(ladderMultiplier(position)), position / 4, 0.006);
  }
}

// Turbulent bricks; those with x in the upper half stand still, the others change with `frame`, whose noise is scaled
// by `moving`.
ImportedGrid halfStill(std::uint32_t frame, float moving) {
  ImportedGrid grid;
  grid.present = true;
  for (std::int32_t b = 0; b < kBricks * kBricks * kBricks; ++b) {
    const std::int32_t x = b / (kBricks * kBricks);
    const bool still = 2 * x >= kBricks;
    std::mt19937 random(static_cast<std::uint32_t>(b) + (still ? 0 : 1000 * (frame + 1)));
    const float loudness = 0.1f + static_cast<float>(b * 7 % 31) / 20;
    Leaf leaf{};
    leaf.origin = {8 * x, 8 * (b / kBricks % kBricks), 8 * (b % kBricks)};
    std::fill(std::begin(leaf.active.words), std::end(leaf.active.words), ~0u);
    for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
      const float noise = static_cast<float>(random() % 1024) / 1024 * (still ? 0.3f : moving) * loudness;
      leaf.values[v] = 0.25f + noise + static_cast<float>(v & 7) / 16;
      grid.max = std::max(grid.max, leaf.values[v]);
    }
    leaf.values[0] = grid.max = 2.0f;  // every frame has the same range
    grid.leaves.push_back(leaf);
    grid.activeVoxels += format::kBrickVoxels;
  }
  return grid;
}

class BudgetTest : public testing::Test {
 protected:
  BudgetTest() : folder_(testing::TempDir() + "budget_" + std::to_string(getpid())) {
    std::filesystem::create_directories(folder_);
  }
  ~BudgetTest() override { std::filesystem::remove_all(folder_); }

  void addFrame(const ImportedGrid& grid) {
    const VdbOutput output{"density", true, {&grid}};
    writeVdb(folder_ + "/s_" + std::to_string(1000 + frames_++) + ".vdb", {&output, 1});
  }
  void addHalfStill(std::uint32_t count) {
    for (std::uint32_t f = 0; f < count; ++f) addFrame(halfStill(f, f % 2 == 0 ? 0.6f : 0.1f));
  }
  CompileReport compileTo(const std::string& name, const CompileOptions& options) {
    return compile({folder_ + "/s_####.vdb"}, folder_ + "/" + name, options, [](const std::string&) {});
  }
  std::string bytesOf(const std::string& name) {
    std::ifstream file(folder_ + "/" + name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::string folder_;
  int frames_ = 0;
};

std::uint64_t reusedBricks(const CompileReport& report) {
  std::uint64_t count = 0;
  for (const EncodingTally& tally : report.grids[0].encodings) count += tally.reused;
  return count;
}

// Loud and quiet frames take turns, so the same bricks would be allocated differently.
TEST_F(BudgetTest, WhatStandsStillIsStoredOnce) {
  addHalfStill(6);
  CompileOptions options;
  options.quality.psnr = 40;
  const CompileReport report = compileTo("a.blw", options);
  EXPECT_GE(report.grids[0].worstPsnr, 40);
  EXPECT_GE(reusedBricks(report), 5u * kBricks * kBricks * kBricks / 2);
}

TEST_F(BudgetTest, AReusedBrickIsMeasuredAgainstItsOwnFrame) {
  // Each frame is a little brighter: after 24 of them a brick that was carried along would be far off.
  for (int f = 0; f < 24; ++f) {
    ImportedGrid grid = halfStill(0, 0.3f);
    for (Leaf& leaf : grid.leaves) {
      for (std::uint32_t v = 1; v < format::kBrickVoxels; ++v) leaf.values[v] += 0.004f * static_cast<float>(f);
    }
    addFrame(grid);
  }
  CompileOptions options;
  options.quality.psnr.reset();
  options.quality.maxError = 0.05f;
  const CompileReport report = compileTo("a.blw", options);
  EXPECT_LE(report.grids[0].maxError, 0.05f);
  EXPECT_GT(reusedBricks(report), 0u);
}

TEST_F(BudgetTest, ARepeatedFrameTakesLessThanAKilobyte) {
  addHalfStill(3);
  const std::uint64_t once = compileTo("a.blw", {}).fileBytes;
  addHalfStill(3);
  EXPECT_LT(compileTo("b.blw", {}).fileBytes, once + 3 * 1024);
}

TEST_F(BudgetTest, GpuAndDiskBudgetsAreKeptAndUsed) {
  addHalfStill(4);
  double lastPsnr = 0;
  for (const std::uint64_t budget : {120000u, 160000u}) {
    CompileOptions options;
    options.budget.gpu = budget;
    const CompileReport report = compileTo("a.blw", options);
    EXPECT_LE(report.gpuBytes, budget);
    EXPECT_GE(report.gpuBytes, budget * 97 / 100);
    EXPECT_GT(report.grids[0].worstPsnr, lastPsnr);
    lastPsnr = report.grids[0].worstPsnr;
  }
  CompileOptions options;
  options.budget.disk = 100000;
  const CompileReport report = compileTo("a.blw", options);
  EXPECT_LE(report.fileBytes, 100000u);
  EXPECT_GE(report.fileBytes, 97000u);
  EXPECT_EQ(report.fileBytes, std::filesystem::file_size(folder_ + "/a.blw"));
}

double squaredError(const CompileReport& report) {
  double sum = 0;
  for (const EncodingTally& tally : report.grids[0].encodings) sum += tally.squaredError;
  return sum;
}

TEST_F(BudgetTest, ADiskBudgetHasLessErrorThanAPsnrThatTakesAsMuch) {
  addHalfStill(4);
  CompileOptions options;
  options.quality.psnr = 38;
  const CompileReport byPsnr = compileTo("a.blw", options);
  options.budget.disk = byPsnr.fileBytes;
  const CompileReport byBudget = compileTo("b.blw", options);
  EXPECT_LE(byBudget.fileBytes, byPsnr.fileBytes);
  EXPECT_LT(squaredError(byBudget), 0.9 * squaredError(byPsnr));
}

// Bricks of very different ranges, all of noise.
ImportedGrid varied() {
  ImportedGrid grid = halfStill(0, 0.5f);
  for (std::size_t b = 1; b < grid.leaves.size(); ++b) {
    const float loudness = std::exp2(-static_cast<float>(b * 61 % 216) / 40);
    for (float& value : grid.leaves[b].values) value = (value == 2 ? 1 : value) * loudness;
  }
  return grid;
}

// On what the disk's budget alone would take, the GPU's is a little short, and the other way round.
TEST_F(BudgetTest, WhereBothBudgetsBindBothAreUsed) {
  addFrame(varied());
  CompileOptions disk, gpu, both;
  disk.budget.disk = 30000;
  const CompileReport byDisk = compileTo("a.blw", disk);
  gpu.budget.gpu = both.budget.gpu = byDisk.gpuBytes * 94 / 100;
  both.budget.disk = disk.budget.disk;
  const CompileReport byGpu = compileTo("b.blw", gpu);
  ASSERT_GT(byGpu.fileBytes, *disk.budget.disk);
  const CompileReport byBoth = compileTo("c.blw", both);
  EXPECT_LE(byBoth.gpuBytes, *both.budget.gpu);
  EXPECT_GE(byBoth.gpuBytes, *both.budget.gpu * 97 / 100);
  EXPECT_LE(byBoth.fileBytes, *both.budget.disk);
  EXPECT_GE(byBoth.fileBytes, *both.budget.disk * 97 / 100);
  EXPECT_LE(squaredError(byBoth), 1.15 * std::max(squaredError(byDisk), squaredError(byGpu)));
}

TEST_F(BudgetTest, ABudgetThatTheOtherOneImpliesChangesNothing) {
  addHalfStill(3);
  CompileOptions options;
  options.budget.gpu = 120000;
  const CompileReport alone = compileTo("a.blw", options);
  options.budget.disk = 1 << 20;
  const CompileReport both = compileTo("b.blw", options);
  EXPECT_EQ(alone.gpuBytes, both.gpuBytes);
  EXPECT_EQ(squaredError(alone), squaredError(both));
}

TEST_F(BudgetTest, BudgetsAreKeptByTheMetricOfDepth) {
  addHalfStill(3);
  CompileOptions options;
  options.quality.metric = Metric::depth;
  options.budget.gpu = 120000;
  const CompileReport byGpu = compileTo("a.blw", options);
  EXPECT_LE(byGpu.gpuBytes, 120000u);
  EXPECT_GE(byGpu.gpuBytes, 116000u);
  options.budget = {std::nullopt, 90000};
  const CompileReport byDisk = compileTo("b.blw", options);
  EXPECT_LE(byDisk.fileBytes, 90000u);
  EXPECT_GE(byDisk.fileBytes, 87000u);
}

TEST_F(BudgetTest, BothBudgetsAndTheLargestErrorHoldTogether) {
  addHalfStill(3);
  CompileOptions options;
  options.budget = {200000, 150000};
  options.quality.maxError = 0.3f;
  const CompileReport report = compileTo("a.blw", options);
  EXPECT_LE(report.gpuBytes, 200000u);
  EXPECT_LE(report.fileBytes, 150000u);
  EXPECT_LE(report.grids[0].maxError, 0.3f);
}

TEST_F(BudgetTest, TheBytesDoNotDependOnThreads) {
  addHalfStill(4);
  CompileOptions options;
  options.budget.disk = 100000;
  options.threads = 1;
  compileTo("one.blw", options);
  options.threads = 7;
  compileTo("seven.blw", options);
  EXPECT_EQ(bytesOf("one.blw"), bytesOf("seven.blw"));
}

TEST_F(BudgetTest, WhatCannotFitNamesTheLeastAndKeepsTheOldPack) {
  addHalfStill(2);
  std::ofstream(folder_ + "/a.blw") << "the pack from before";
  CompileOptions options;
  options.budget.gpu = 100;
  try {
    compileTo("a.blw", options);
    FAIL() << "100 bytes hold no sequence";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    EXPECT_NE(std::string(error.what()).find("--gpu-budget 100 is out of reach"), std::string::npos) << error.what();
  }
  EXPECT_EQ(bytesOf("a.blw"), "the pack from before");
}

TEST_F(BudgetTest, AGenerousBudgetEndsAtTheBestQuality) {
  addHalfStill(2);
  CompileOptions options;
  options.budget.gpu = std::uint64_t{1} << 30;
  const CompileReport report = compileTo("a.blw", options);
  EXPECT_LT(report.gpuBytes, std::uint64_t{1} << 20);
  EXPECT_GT(report.grids[0].worstPsnr, 90);
}

}  // namespace
}  // namespace billow::compiler
