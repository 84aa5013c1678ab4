// The error of line integrals, against sums taken voxel by voxel.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>

#include "metric/depth_distortion.h"
#include "metric/depth_error.h"

namespace billow::compiler {
namespace {

using Voxel = std::array<std::int32_t, 3>;

// Calls visit(voxel, value - background) for every active voxel.
template <class Visit>
void forEachVoxel(const ImportedGrid& grid, const Visit& visit) {
  const auto background = static_cast<double>(grid.background);
  for (const Leaf& leaf : grid.leaves) {
    for (std::int32_t i = 0; i < 512; ++i) {
      if (!format::maskBit(leaf.active, static_cast<std::uint32_t>(i))) continue;
      visit(Voxel{leaf.origin[0] + i / 64, leaf.origin[1] + i / 8 % 8, leaf.origin[2] + i % 8},
            static_cast<double>(leaf.values[static_cast<std::size_t>(i)]) - background);
    }
  }
  for (const Tile& tile : grid.tiles) {
    const auto dim = static_cast<std::int32_t>(tile.dim);
    for (std::int32_t x = 0; x < dim; ++x) {
      for (std::int32_t y = 0; y < dim; ++y) {
        for (std::int32_t z = 0; z < dim; ++z) {
          visit(Voxel{tile.origin[0] + x, tile.origin[1] + y, tile.origin[2] + z},
                static_cast<double>(tile.value) - background);
        }
      }
    }
  }
}

// By the definition: voxels p and p + step are on one line. A line is known by its voxel whose first coordinate along
// the step is 0.
DepthError bruteForce(const ImportedGrid& source, const ImportedGrid& result) {
  DepthError error;
  for (std::int32_t dx = 0; dx <= 1; ++dx) {
    for (std::int32_t dy = -1; dy <= 1; ++dy) {
      for (std::int32_t dz = -1; dz <= 1; ++dz) {
        const std::array<std::int32_t, 3> step{dx, dy, dz};
        const int moved = std::abs(dx) + std::abs(dy) + std::abs(dz);
        const auto* const first = std::find_if(step.begin(), step.end(), [](std::int32_t s) { return s != 0; });
        if (moved == 0 || moved == 3 || *first < 0) continue;  // one of each pair of opposite directions
        const auto axis = static_cast<std::size_t>(first - step.begin());
        std::map<Voxel, std::array<double, 2>> lines;
        const auto add = [&](const ImportedGrid& grid, std::size_t which) {
          forEachVoxel(grid, [&](const Voxel& at, double value) {
            const std::int32_t along = at[axis];
            Voxel line;
            for (std::size_t a = 0; a < 3; ++a) line[a] = at[a] - along * step[a];
            lines[line][which] += value * std::sqrt(static_cast<double>(moved));
          });
        };
        add(source, 0);
        add(result, 1);
        for (const auto& [line, sums] : lines) {
          ++error.lines;
          error.squaredError += (sums[1] - sums[0]) * (sums[1] - sums[0]);
          error.leastIntegral = std::min(error.leastIntegral, sums[0]);
          error.largestIntegral = std::max(error.largestIntegral, sums[0]);
        }
      }
    }
  }
  return error;
}

void expectEqual(const DepthError& measured, const DepthError& expected) {
  EXPECT_EQ(measured.lines, expected.lines);
  EXPECT_NEAR(measured.squaredError, expected.squaredError, 1e-9 * expected.squaredError);
  EXPECT_NEAR(measured.leastIntegral, expected.leastIntegral, 1e-9 * std::abs(expected.leastIntegral));
  EXPECT_NEAR(measured.largestIntegral, expected.largestIntegral, 1e-9 * expected.largestIntegral);
}

Leaf randomLeaf(const Voxel& origin, float background, std::mt19937& random) {
  std::uniform_real_distribution<float> value(-1, 3);
  Leaf leaf{origin, {}, {}};
  for (std::uint32_t& word : leaf.active.words) word = static_cast<std::uint32_t>(random() & random());
  leaf.active.words[3] |= 1;  // never empty
  for (std::uint32_t i = 0; i < 512; ++i) {
    leaf.values[i] = format::maskBit(leaf.active, i) ? value(random) : background;
  }
  return leaf;
}

// Leaves on both sides of the origin, some side by side, some far away.
ImportedGrid randomGrid(std::uint32_t seed, float background) {
  std::mt19937 random(seed);
  ImportedGrid grid;
  grid.present = true;
  grid.background = background;
  for (const Voxel& origin : {Voxel{-16, 0, 8}, Voxel{-8, -8, 0}, Voxel{-8, 0, 0}, Voxel{0, 0, 0}, Voxel{8, 8, -8},
                              Voxel{16, -24, 8}, Voxel{3000, -2000, 800}}) {
    grid.leaves.push_back(randomLeaf(origin, background, random));
  }
  return grid;
}

ImportedGrid disturbed(ImportedGrid grid, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> error(-0.1f, 0.1f);
  for (Leaf& leaf : grid.leaves) {
    for (std::uint32_t i = 0; i < 512; ++i) {
      if (format::maskBit(leaf.active, i)) leaf.values[i] += error(random);
    }
  }
  return grid;
}

TEST(DepthError, IsThatOfSumsTakenVoxelByVoxel) {
  for (const float background : {0.f, 0.5f}) {
    ImportedGrid source = randomGrid(1, background);
    source.tiles.push_back({{-24, 16, 0}, 8, 1.5f});
    const ImportedGrid result = disturbed(source, 2);
    const DepthError measured = measureDepth(source, result);
    EXPECT_GT(measured.squaredError, 0);
    EXPECT_LT(measured.leastIntegral, 0);
    expectEqual(measured, bruteForce(source, result));
  }
}

TEST(DepthError, VoxelsThatOnlyOneGridHasCount) {
  const ImportedGrid source = randomGrid(1, 0);
  ImportedGrid result = source;
  result.leaves.erase(result.leaves.begin() + 3);
  const DepthError fewer = measureDepth(source, result);
  const DepthError more = measureDepth(result, source);
  expectEqual(fewer, bruteForce(source, result));
  expectEqual(more, bruteForce(result, source));
  EXPECT_EQ(fewer.lines, more.lines);
}

TEST(DepthError, LargeTilesAreTheSumOfTheirVoxels) {
  ImportedGrid source = randomGrid(3, 0.25f);
  source.tiles.push_back({{-128, 16, -64}, 128, 2});  // as a pack's origin may shift it: not aligned to its size
  const ImportedGrid result = disturbed(source, 4);
  expectEqual(measureDepth(source, result), bruteForce(source, result));
}

TEST(DepthError, ACellIsTheSameAsTileAndAsLeaf) {
  ImportedGrid source = randomGrid(5, 0);
  ImportedGrid result = source;
  Leaf leaf{{24, 24, 24}, {}, {}};
  std::fill(std::begin(leaf.active.words), std::end(leaf.active.words), ~0u);
  leaf.values.fill(0.1f);
  source.leaves.push_back(leaf);
  result.tiles.push_back({leaf.origin, 8, 0.1f});
  const DepthError measured = measureDepth(source, result);
  EXPECT_EQ(measured.squaredError, 0);
  EXPECT_EQ(measured.psnr(), std::numeric_limits<double>::infinity());
}

TEST(DepthError, OfACubeByHand) {
  // 8^3 voxels of 1, off by 0.5: every axis has 64 lines of integral 8, every diagonal 8 * 15, the longest 8 sqrt(2).
  ImportedGrid source;
  source.tiles.push_back({{0, 0, 0}, 8, 1});
  ImportedGrid result = source;
  result.tiles[0].value = 1.5f;
  const DepthError measured = measureDepth(source, result);
  EXPECT_EQ(measured.lines, 3u * 64 + 6 * 120);
  EXPECT_DOUBLE_EQ(measured.range(), 8 * std::sqrt(2.0));
  // Sum of squares of 1 .. 8 .. 1 is 344.
  EXPECT_DOUBLE_EQ(measured.squaredError, 3 * 64 * 16 + 6 * 8 * 0.5 * 344);
  EXPECT_DOUBLE_EQ(measured.psnr(),
                   20 * std::log10(measured.range() / std::sqrt(measured.squaredError / (3 * 64 + 6 * 120))));
}

// What the measure is for: noise of one strength costs a thick volume less than the same error everywhere does.
TEST(DepthError, NoiseAveragesOutWhereABiasAddsUp) {
  ImportedGrid source;
  for (std::int32_t x = 0; x < 64; x += 8) {
    for (std::int32_t y = 0; y < 64; y += 8) {
      for (std::int32_t z = 0; z < 64; z += 8) {
        source.tiles.push_back({{x, y, z}, 8, 1});
      }
    }
  }
  ImportedGrid noisy, biased = source;
  std::mt19937 random(1);
  for (Tile& tile : biased.tiles) {
    tile.value += 0.125f;
    Leaf& leaf = noisy.leaves.emplace_back(Leaf{tile.origin, {}, {}});
    std::fill(std::begin(leaf.active.words), std::end(leaf.active.words), ~0u);
    for (float& value : leaf.values) value = random() % 2 == 0 ? 1.125f : 0.875f;
  }
  const double noise = measureDepth(source, noisy).psnr();
  const double bias = measureDepth(source, biased).psnr();
  EXPECT_GT(noise, bias + 12);  // sums of n random signs grow as sqrt(n); along an axis n is 64
}

TEST(DepthError, DoesNotDependOnThreads) {
  const ImportedGrid source = randomGrid(7, 0);
  const ImportedGrid result = disturbed(source, 8);
  const DepthError many = measureDepth(source, result);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(many.squaredError, measureDepth(source, result).squaredError);
}

TEST(DepthDistortion, OfABrickIsTheErrorOfItsLines) {
  std::mt19937 random(9);
  const Leaf result = randomLeaf({0, 0, 0}, 0, random);
  ImportedGrid zeros, errors;
  zeros.leaves.push_back(result);
  zeros.leaves[0].values.fill(0);
  errors.leaves.push_back(result);
  const double expected = bruteForce(zeros, errors).squaredError;
  EXPECT_NEAR(depthDistortion(result.values), expected, 1e-9 * expected);
}

TEST(DepthError, NothingHasNoError) {
  const DepthError error = measureDepth({}, {});
  EXPECT_EQ(error.lines, 0u);
  EXPECT_EQ(error.rmse(), 0);
  EXPECT_EQ(error.psnr(), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace billow::compiler
