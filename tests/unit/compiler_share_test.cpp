// The share stage: trees come back as they went in, tiles stay tiles, and nothing equal is stored twice.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <random>

#include "billow/format/grid_view.h"
#include "billow/format/validate.h"
#include "grids.h"
#include "share/share.h"

namespace billow::compiler {
namespace {

using tests::emptyGrid;

const std::string kWhere = "test";

class ShareTest : public testing::Test {
 protected:
  ShareTest() : path_(testing::TempDir() + "share_" + std::to_string(getpid()) + ".blw") {}
  ~ShareTest() override { std::filesystem::remove(path_); }

  // One volume with one grid; each element of `grids` is a frame. `given`: its bricks, if they are not to be chosen.
  void writePack(const std::vector<ImportedGrid>& grids, const std::vector<ChosenGrid>& given = {}) {
    format::PackWriter writer(path_, {});
    Sharer sharer(writer);
    format::PackTables tables;
    tables.volumes.push_back({tables.addString("v"), 0, 1, 0, static_cast<std::uint32_t>(grids.size()), 0, 24, {}});
    format::GridRecord record{};
    record.name = tables.addString("density");
    record.component = format::kNone;
    tables.grids.push_back(record);
    for (std::size_t f = 0; f < grids.size(); ++f) {
      tables.frames.push_back({static_cast<std::int32_t>(f), 0, static_cast<double>(f) / 24});
      Quality quality;
      quality.psnr = 60;
      const auto chosen = !given.empty() ? std::vector{given[f]}
                                         : chooseEncodings({&grids[f], 1}, quality, [](std::size_t) { return kWhere; });
      std::vector<std::uint32_t> pages;
      format::GridFrame frame = sharer.addGrid(grids[f], chosen[0], kWhere, pages);
      frame.flags = format::kGridPresent;
      frame.pageListBegin = static_cast<std::uint32_t>(tables.pageLists.size());
      frame.pageListCount = static_cast<std::uint32_t>(pages.size());
      tables.pageLists.insert(tables.pageLists.end(), pages.begin(), pages.end());
      tables.gridFrames.push_back(frame);
    }
    writer.finish(tables);
  }

  format::Pack open() {
    format::validate(**format::openFileSource(path_), {},
                     [](const format::Issue& issue) { ADD_FAILURE() << format::toString(issue); });
    auto pack = format::Pack::openFile(path_);
    EXPECT_TRUE(pack.has_value());
    return std::move(*pack);
  }

  std::string path_;
};

void addLeaf(ImportedGrid& grid, std::array<std::int32_t, 3> origin, float value) {
  Leaf leaf{};
  leaf.origin = origin;
  for (std::uint32_t v = 0; v < format::kBrickVoxels; v += 3) {
    leaf.active.words[v >> 5] |= 1u << (v & 31);
    leaf.values[v] = value * static_cast<float>(1 + v % 7);
    grid.max = std::max(grid.max, leaf.values[v]);
    grid.min = std::min(grid.min, leaf.values[v]);
    ++grid.activeVoxels;
  }
  grid.leaves.push_back(leaf);
}

void addTile(ImportedGrid& grid, std::array<std::int32_t, 3> origin, std::uint32_t dim, float value) {
  grid.tiles.push_back({origin, dim, value});
  grid.activeVoxels += std::uint64_t{dim} * dim * dim;
  grid.max = std::max(grid.max, value);
}

TEST_F(ShareTest, ValuesAndTransformComeBackInNegativeSpace) {
  ImportedGrid grid = emptyGrid();
  addLeaf(grid, {-4008, -16, 0}, 0.5f);
  addLeaf(grid, {-8, 8, 64}, 0.25f);
  grid.indexToWorld = {0.5, 0, 0, 10, 0, 2, 0, 20, 0, 0, 1, 30};
  writePack({grid});
  const format::Pack pack = open();
  const auto view = format::GridView::load(pack, pack.gridFrames()[0]);
  ASSERT_TRUE(view.has_value());
  const format::GridFrame& frame = view->frame();
  EXPECT_DOUBLE_EQ(frame.indexToWorld[3], 10 + 0.5 * frame.origin[0]);
  EXPECT_DOUBLE_EQ(frame.indexToWorld[7], 20 + 2.0 * frame.origin[1]);
  for (const Leaf& leaf : grid.leaves) {
    for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
      const std::int64_t at[3] = {leaf.origin[0] - frame.origin[0] + (v >> 6),
                                  leaf.origin[1] - frame.origin[1] + (v >> 3 & 7),
                                  leaf.origin[2] - frame.origin[2] + (v & 7)};
      EXPECT_NEAR(view->voxel(at[0], at[1], at[2]), leaf.values[v], 0.03f);
    }
  }
}

TEST_F(ShareTest, TilesStayTilesAtEveryLevel) {
  ImportedGrid grid = emptyGrid();
  addTile(grid, {0, 0, 0}, 128, 0.5f);
  addTile(grid, {128, 0, 0}, 8, 0.25f);
  writePack({grid});
  ImportedGrid root = emptyGrid();
  {
    const format::Pack pack = open();
    const auto view = format::GridView::load(pack, pack.gridFrames()[0]);
    ASSERT_TRUE(view.has_value());
    ASSERT_EQ(view->tiles().size(), 1u);
    EXPECT_EQ(view->tiles()[0].dim, 128u);
    EXPECT_EQ(view->voxel(127, 127, 127), 0.5f);
    EXPECT_EQ(view->voxel(135, 7, 7), 0.25f);
    EXPECT_EQ(view->voxel(136, 7, 7), 0.0f);
    EXPECT_LT(pack.fileSize(), 16u << 10);
  }
  addTile(root, {-4096, 0, 0}, 4096, 3.0f);
  writePack({root});
  const format::Pack pack = open();
  const auto view = format::GridView::load(pack, pack.gridFrames()[0]);
  ASSERT_TRUE(view.has_value());
  EXPECT_EQ(view->voxel(0, 4095, 17), 3.0f);
  EXPECT_EQ(view->frame().origin[0], -4096);
}

TEST_F(ShareTest, UnalignedTilesAreCutButKeepTheirValues) {
  ImportedGrid grid = emptyGrid();
  addLeaf(grid, {-8, 0, 0}, 1.0f);
  addTile(grid, {3840, 0, 0}, 128, 0.5f);  // -8 ... 3967 spans less than 4096, but not at any 128-aligned origin
  addTile(grid, {3968, 0, 0}, 8, 0.5f);
  writePack({grid});
  const format::Pack pack = open();
  const auto view = format::GridView::load(pack, pack.gridFrames()[0]);
  ASSERT_TRUE(view.has_value());
  const std::int64_t shift = -view->frame().origin[0];
  EXPECT_EQ(view->voxel(3840 + shift, 0, 0), 0.5f);
  EXPECT_EQ(view->voxel(3967 + shift, 127, 127), 0.5f);
  EXPECT_EQ(view->voxel(3839 + shift, 0, 0), 0.0f);
}

TEST_F(ShareTest, EqualFramesCostNothing) {
  ImportedGrid grid = emptyGrid();
  for (std::int32_t i = 0; i < 64; ++i) addLeaf(grid, {i * 8, 8 * (i % 3), 0}, 0.01f * static_cast<float>(i));
  writePack({grid});
  const std::uint64_t one = open().fileSize();
  writePack({grid, grid, grid, grid});
  const format::Pack pack = open();
  EXPECT_LT(pack.fileSize(), one + 3 * 512);
  EXPECT_EQ(pack.gridFrames()[0].node5, pack.gridFrames()[3].node5);
}

// Frames of about 200 KB each that have a few bricks of the first in common: none reads more than its own share of
// pages.
TEST_F(ShareTest, FewEqualBricksMakeNoFrameReadOldPages) {
  std::vector<ImportedGrid> grids;
  std::vector<ChosenGrid> chosen;
  std::mt19937 random(1);
  for (std::int32_t frame = 0; frame < 8; ++frame) {
    grids.push_back(emptyGrid());
    chosen.emplace_back();
    for (std::int32_t i = 0; i < 400; ++i) {
      Leaf leaf{};
      leaf.origin = {8 * (i % 20), 8 * (i / 20), 0};
      std::fill(std::begin(leaf.active.words), std::end(leaf.active.words), ~0u);
      grids.back().leaves.push_back(leaf);
      grids.back().activeVoxels += format::kBrickVoxels;
      std::vector<std::byte> payload(512, static_cast<std::byte>(i));
      // Bricks 0, 40, 80... are the same in all frames.
      for (std::byte& byte : payload) byte = i % 40 == 0 ? byte : static_cast<std::byte>(random());
      chosen.back().bricks.push_back({format::uniformEncoding(8), false, 0, 0.01f, payload});
    }
  }
  writePack(grids, chosen);
  const format::Pack pack = open();
  for (const format::GridFrame& frame : pack.gridFrames()) EXPECT_LE(frame.pageListCount, 3u);
  // Equal frames are the same all the same, however their pages are filled.
  grids.push_back(grids[2]);
  chosen.push_back(chosen[2]);
  writePack(grids, chosen);
  EXPECT_EQ(open().gridFrames()[8].node5, pack.gridFrames()[2].node5);
}

// 64 zero bytes are a uniform brick of one bit as well as a coarse one.
TEST_F(ShareTest, EqualBytesOfDifferentEncodingsAreTwoBricks) {
  ImportedGrid grid = emptyGrid();
  ChosenGrid chosen;
  for (const std::uint32_t encoding : {format::uniformEncoding(1), format::kEncodingCoarse, format::kEncodingCoarse}) {
    Leaf leaf{};
    leaf.origin = {8 * static_cast<std::int32_t>(grid.leaves.size()), 0, 0};
    std::fill(std::begin(leaf.active.words), std::end(leaf.active.words), ~0u);
    grid.leaves.push_back(leaf);
    grid.activeVoxels += format::kBrickVoxels;
    chosen.bricks.push_back({encoding, false, 1, 1, std::vector<std::byte>(64)});
  }
  writePack({grid}, {chosen});
  const format::Pack pack = open();
  EXPECT_TRUE(format::GridView::load(pack, pack.gridFrames()[0]).has_value());
  EXPECT_EQ(pack.gridFrames()[0].brickCount[static_cast<std::size_t>(format::BrickClass::uniform)], 1u);
  EXPECT_EQ(pack.gridFrames()[0].brickCount[static_cast<std::size_t>(format::BrickClass::coarse)], 1u);
}

TEST_F(ShareTest, AnEmptyGridIsSound) {
  writePack({emptyGrid()});
  const format::Pack pack = open();
  const auto view = format::GridView::load(pack, pack.gridFrames()[0]);
  ASSERT_TRUE(view.has_value());
  EXPECT_TRUE(view->leaves().empty());
  EXPECT_EQ(view->voxel(0, 0, 0), 0.0f);
}

TEST(Origin, IsAsCoarselyAlignedAsFits) {
  EXPECT_EQ((chooseOrigin({5, -3, 4090}, {100, 7, 4100}, kWhere)), (std::array<std::int32_t, 3>{0, -128, 3968}));
  EXPECT_EQ((chooseOrigin({-8, 0, 0}, {4087, 4095, 4095}, kWhere)), (std::array<std::int32_t, 3>{-8, 0, 0}));
}

TEST(Origin, RefusesWhatDoesNotFit) {
  try {
    chooseOrigin({0, 0, 0}, {10, 6000, 10}, kWhere);
    FAIL() << "6001 voxels fit in 4096";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("from 0 to 6000 along y"), std::string::npos);
  }
}

}  // namespace
}  // namespace billow::compiler
