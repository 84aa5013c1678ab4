// The GPU's getVoxel gives the same bits as the CPU's, for every encoding, mask and index; trilinear reads are what
// the eight voxels around make of them.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>
#include <tuple>

#include "gpu_fixture.h"

namespace billow::tests {
namespace {

using format::GridView;
using runtime::BlockUse;
using runtime::Filter;
using runtime::Index;

format::Mask3 someMask(std::uint32_t seed) {
  std::mt19937 random(seed);
  format::Mask3 mask;
  for (std::uint32_t& word : mask.words) word = static_cast<std::uint32_t>(random());
  return mask;
}

// Every encoding beside every other, each with all kinds of masks it may have, bricks at the edges of nodes, and a
// tile. Where `integers` are asked for, every value is one.
std::vector<std::byte> everything(bool integers = false) {
  return oneGridPack(integers ? 16 : 0.0625f, [&](GridFrameBuilder& grid) {
    using namespace format;
    const float lo = integers ? -7 : -0.7f;
    for (std::uint32_t encoding = 0; encoding < kEncodingCount; ++encoding) {
      const auto bytes = [&](std::uint32_t seed) { return randomBytes(*brickBytes(encoding), seed + encoding); };
      const float largest = static_cast<float>(largestTexel(encoding));
      float scale = integers ? 1 : (0.8f + 0.1f * static_cast<float>(encoding)) / largest;
      if (encoding == kEncodingConstant) scale = 0;
      const std::uint32_t x = 15 + encoding / 5, y = 15 + encoding % 5;
      grid.brick({x, y, 16}, encoding, bytes(0), lo, scale, kMaskAll);
      grid.brick({x, y, 17}, encoding, bytes(90), lo + 1, scale, 0, someMask(encoding));
      if (indexBits(encoding) != 0) grid.brick({x, y, 15}, encoding, bytes(40), lo + 2, scale, kMaskTexel);
    }
    grid.tile({0, 0, 0}, 2);
  });
}

// Centres of all voxels of all leaves with their neighbours, of tiles' corners, and some far outside.
std::vector<float> interestingVoxels(const GridView& view) {
  std::set<std::tuple<int, int, int>> voxels;
  for (const GridView::Leaf& leaf : view.leaves()) {
    for (int i = 0; i < 1000; ++i) {
      const int local[3] = {i / 100 - 1, i / 10 % 10 - 1, i % 10 - 1};
      voxels.insert({static_cast<int>(leaf.origin[0]) + local[0], static_cast<int>(leaf.origin[1]) + local[1],
                     static_cast<int>(leaf.origin[2]) + local[2]});
    }
  }
  for (const GridView::Tile& tile : view.tiles()) {
    for (int i = 0; i < 64; ++i) {
      const auto at = [&](int axis, int step) {
        const int dim = static_cast<int>(tile.dim);
        const int offsets[4] = {-1, 0, dim - 1, dim};
        return static_cast<int>(tile.origin[axis]) + offsets[step];
      };
      voxels.insert({at(0, i / 16), at(1, i / 4 % 4), at(2, i % 4)});
    }
  }
  voxels.insert({-5, 0, 0});
  voxels.insert({4095, 4095, 4095});
  voxels.insert({5000, 10, 10});
  std::vector<float> positions;
  for (const auto& [x, y, z] : voxels) {
    positions.insert(positions.end(), {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  }
  return positions;
}

float cpuVoxel(const GridView& view, const float* position) {
  return view.voxel(std::lround(position[0]), std::lround(position[1]), std::lround(position[2]));
}

double cpuTrilinear(const GridView& view, const float* p) {
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    std::int64_t at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double base = std::floor(double{p[axis]});
      const int upper = corner >> axis & 1;
      weight *= upper != 0 ? p[axis] - base : 1 - (p[axis] - base);
      at[axis] = static_cast<std::int64_t>(base) + upper;
    }
    sum += weight * double{view.voxel(at[0], at[1], at[2])};
  }
  return sum;
}

struct LookupCase {
  Index index;
  BlockUse blocks;
};

class Lookup : public GpuTest, public testing::WithParamInterface<LookupCase> {};

TEST_P(Lookup, NearestIsTheSameToTheBit) {
  const format::Pack pack = openPack(everything());
  const auto view = GridView::load(pack, pack.gridFrames()[0]);
  ASSERT_TRUE(view.has_value());
  const auto renderer = makeRenderer({.blocks = GetParam().blocks});
  const auto frame = upload(*renderer, pack, 0, {.index = GetParam().index});
  const std::vector<float> positions = interestingVoxels(*view);
  const auto values = gpu().lookup(*renderer, *frame, 0, Filter::nearest, positions);
  ASSERT_TRUE(values.has_value()) << values.error().message;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < values->size(); ++i) {
    const float expected = cpuVoxel(*view, &positions[i * 3]);
    if (std::bit_cast<std::uint32_t>((*values)[i]) == std::bit_cast<std::uint32_t>(expected)) continue;
    if (++wrong > 5) continue;
    ADD_FAILURE() << "(" << positions[i * 3] << ", " << positions[i * 3 + 1] << ", " << positions[i * 3 + 2]
                  << "): GPU " << (*values)[i] << ", CPU " << expected;
  }
  EXPECT_EQ(wrong, 0u) << "of " << values->size();
}

// Positions in and around all bricks of everything(), multiples of 1 / steps.
std::vector<float> randomPositions(std::uint32_t steps) {
  constexpr std::uint32_t kLow[3] = {116, 114, 114};
  constexpr std::uint32_t kSpan[3] = {40, 48, 34};
  std::vector<float> positions;
  std::mt19937 random(5);
  for (int i = 0; i < 3 * 12000; ++i) {
    const float offset = static_cast<float>(random() % (kSpan[i % 3] * steps)) / static_cast<float>(steps);
    positions.push_back(static_cast<float>(kLow[i % 3]) + offset);
  }
  return positions;
}

TEST_P(Lookup, TrilinearIsExactAcrossFaces) {
  const format::Pack pack = openPack(everything());
  const auto view = GridView::load(pack, pack.gridFrames()[0]);
  ASSERT_TRUE(view.has_value());
  const auto renderer = makeRenderer({.blocks = GetParam().blocks});
  const auto frame = upload(*renderer, pack, 0, {.index = GetParam().index});
  const std::vector<float> positions = randomPositions(4096);
  const auto values = gpu().lookup(*renderer, *frame, 0, Filter::trilinear, positions);
  ASSERT_TRUE(values.has_value()) << values.error().message;
  for (std::size_t i = 0; i < values->size(); ++i) {
    // Three linear steps of rounding on values up to 4.
    ASSERT_NEAR((*values)[i], cpuTrilinear(*view, &positions[i * 3]), 3e-6) << "sample " << i;
  }
}

// Integers of less than 2^17, weighted by multiples of 1/64: sums have 23 bits at most, so nothing may be rounded.
TEST_P(Lookup, TrilinearIsTheSameToTheBitWhereNothingIsRounded) {
  const format::Pack pack = openPack(everything(true));
  const auto view = GridView::load(pack, pack.gridFrames()[0]);
  ASSERT_TRUE(view.has_value());
  const auto renderer = makeRenderer({.blocks = GetParam().blocks});
  const auto frame = upload(*renderer, pack, 0, {.index = GetParam().index});
  const std::vector<float> positions = randomPositions(4);
  const auto values = gpu().lookup(*renderer, *frame, 0, Filter::trilinear, positions);
  ASSERT_TRUE(values.has_value()) << values.error().message;
  for (std::size_t i = 0; i < values->size(); ++i) {
    ASSERT_EQ(double{(*values)[i]}, cpuTrilinear(*view, &positions[i * 3]))
        << "sample " << i << " at (" << positions[i * 3] << ", " << positions[i * 3 + 1] << ", " << positions[i * 3 + 2]
        << ")";
  }
}

INSTANTIATE_TEST_SUITE_P(All, Lookup,
                         testing::Values(LookupCase{Index::flat, BlockUse::native},
                                         LookupCase{Index::tree, BlockUse::native},
                                         LookupCase{Index::dense, BlockUse::native},
                                         LookupCase{Index::flat, BlockUse::decoded},
                                         LookupCase{Index::tree, BlockUse::decoded}));

class Upload : public GpuTest {};

TEST_F(Upload, CountsTheBytesThatTheFormatPromises) {
  const format::Pack pack = openPack(oneGridPack(0, [](GridFrameBuilder& grid) {
    for (std::uint32_t i = 0; i < 7; ++i) {
      grid.brick({10, 10, 10 + i}, format::kEncodingBc7Z, randomBytes(128, i), 0, 0.01f, format::kMaskAll);
    }
    grid.brick({10, 11, 10}, format::kEncodingUniform8, randomBytes(512, 9), 0, 0.01f, 0, someMask(1));
    grid.brick({10, 11, 11}, format::kEncodingUniform16, randomBytes(1024, 9), 0, 0.0001f, format::kMaskAll);
    grid.brick({10, 11, 12}, format::kEncodingLocal2, randomBytes(160, 9), 0, 0.001f, format::kMaskTexel);
    grid.brick({10, 11, 13}, format::kEncodingCoarse, randomBytes(64, 9), 0, 0.001f, format::kMaskAll);
  }));
  const auto renderer = makeRenderer({.blocks = BlockUse::native});
  const std::uint64_t before = renderer->bytesInUse();
  const auto frame = upload(*renderer, pack);
  const format::GpuBytes promised = format::gpuBytes(pack.gridFrames()[0]);
  EXPECT_EQ(frame->stats().payload(), promised.total());
  EXPECT_EQ(frame->stats().maskBytes, promised.maskBytes);
  EXPECT_EQ(frame->stats().bc7Bricks, 7u);
  EXPECT_EQ(frame->stats().bufferBricks, 4u);
  EXPECT_GE(frame->stats().allocatedBytes, frame->stats().payload());
  EXPECT_GE(renderer->bytesInUse(), before + frame->stats().allocatedBytes);
  gpu().waitIdle();
}

TEST_F(Upload, HasOneRecordForEqualTilesAndNoneForTheBackground) {
  const format::Pack pack = openPack(oneGridPack(0, [](GridFrameBuilder& grid) {
    grid.brick({10, 10, 10}, format::kEncodingConstant, {}, 1, 0, format::kMaskAll);
    grid.tile({0, 1, 0}, 2.5f);
    grid.tile({0, 1, 1}, 2.5f);
    grid.tile({1, 1, 0}, 0);
    grid.tile({1, 1, 1}, 3.5f);
  }));
  const auto renderer = makeRenderer();
  for (const Index index : {Index::flat, Index::tree, Index::dense}) {
    const auto frame = renderer->upload(pack, 0, 0, {.index = index});
    ASSERT_TRUE(frame.has_value()) << frame.error().message;
    EXPECT_EQ((*frame)->stats().recordBytes, 3u * 16u);
    EXPECT_EQ((*frame)->stats().recordBytes, format::gpuBytes(pack.gridFrames()[0]).recordBytes);
    gpu().waitIdle();
  }
}

TEST_F(Upload, RefusesWhatExceedsTheBudgetAndAllocatesNothing) {
  const format::Pack pack = openPack(everything());
  const auto renderer = makeRenderer({.gpuBudget = 24000});
  const std::uint64_t before = renderer->bytesInUse();
  const auto frame = renderer->upload(pack, 0, 0, {});
  ASSERT_FALSE(frame.has_value());
  EXPECT_EQ(frame.error().code, runtime::ErrorCode::budget);
  EXPECT_EQ(renderer->bytesInUse(), before);
}

TEST_F(Upload, GivesStagingBackOnceItIsDone) {
  const format::Pack pack = openPack(everything());
  const auto renderer = makeRenderer();
  auto first = upload(*renderer, pack);
  gpu().waitIdle();
  auto second = upload(*renderer, pack);
  gpu().waitIdle();
  const std::uint64_t withTwo = renderer->bytesInUse();
  first.reset();
  const std::uint64_t withOne = renderer->bytesInUse();
  EXPECT_EQ(withTwo - withOne, second->stats().allocatedBytes);
  second.reset();
  EXPECT_LT(renderer->bytesInUse(), withOne);
}

TEST_F(Upload, TakesFramesWithoutAnythingActive) {
  const format::Pack pack = openPack(smallestPack());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  EXPECT_TRUE(frame->empty());
  const auto picture = gpu().render(*renderer, {.frame = frame.get(), .width = 9, .height = 5});
  ASSERT_TRUE(picture.has_value()) << picture.error().message;
  for (const float value : picture->rgba) EXPECT_EQ(value, 0);
  for (const float value : picture->depth) EXPECT_TRUE(std::isinf(value));
}

TEST_F(Upload, NamesWhatIsOutOfRange) {
  const format::Pack pack = openPack(everything());
  const auto renderer = makeRenderer();
  EXPECT_EQ(renderer->upload(pack, 1, 0, {}).error().code, runtime::ErrorCode::argument);
  EXPECT_EQ(renderer->upload(pack, 0, 1, {}).error().code, runtime::ErrorCode::argument);
  const auto frame = upload(*renderer, pack);
  const auto bad = gpu().render(*renderer, {.frame = frame.get(), .quality = {.step = 0}, .width = 4, .height = 4});
  ASSERT_FALSE(bad.has_value());
  EXPECT_NE(bad.error().message.find("quality.step"), std::string::npos);
  gpu().waitIdle();
}

}  // namespace
}  // namespace billow::tests
