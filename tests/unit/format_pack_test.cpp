// Whole packs: written, opened, walked; deterministic, and gone without trace when they fail.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "billow/format/grid_view.h"
#include "billow/format/temp_file.h"
#include "billow/format/validate.h"
#include "sample_pack.h"

namespace billow {
namespace {

using namespace format;

Pack openBytes(std::vector<std::byte> bytes) {
  Result<Pack> pack = Pack::open(makeMemorySource(std::move(bytes)));
  EXPECT_TRUE(pack.has_value()) << (pack ? "" : toString(pack.error()));
  return std::move(*pack);
}

std::vector<std::string> issuesOf(std::vector<std::byte> bytes, unsigned threads = 1) {
  std::vector<std::string> lines;
  ValidateOptions options;
  options.threads = threads;
  validate(*makeMemorySource(std::move(bytes)), options, [&](const Issue& issue) { lines.push_back(toString(issue)); });
  return lines;
}

class TempFolder {
 public:
  TempFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "billow_test_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  ~TempFolder() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  bool empty() const { return std::filesystem::is_empty(path_); }

 private:
  std::filesystem::path path_;
};

TEST(Pack, SmallestIsSound) {
  EXPECT_EQ(issuesOf(tests::smallestPack()), std::vector<std::string>{});
  const Pack pack = openBytes(tests::smallestPack());
  ASSERT_EQ(pack.volumes().size(), 1u);
  EXPECT_EQ(pack.string(pack.volumes()[0].name), "v");
  EXPECT_EQ(pack.gridFrame(pack.volumes()[0], 0, 0).node5, kNone);
  EXPECT_EQ(*pack.infoJson(), "");
}

TEST(Pack, SampleIsSoundAndReadsBack) {
  const std::vector<std::byte> bytes = tests::samplePack();
  EXPECT_EQ(issuesOf(bytes), std::vector<std::string>{});
  const Pack pack = openBytes(bytes);
  EXPECT_EQ(pack.fileSize(), bytes.size());
  EXPECT_EQ(pack.gridsOf(pack.volumes()[0]).size(), 2u);
  EXPECT_EQ(pack.string(pack.grids()[1].name), "flames");
  EXPECT_EQ(pack.framesOf(pack.volumes()[0])[1].number, 8);
  EXPECT_EQ(*pack.infoJson(), "{\"generator\": \"test\"}");
}

TEST(Pack, WritesTheSameBytesEveryTime) {
  EXPECT_EQ(tests::samplePack(), tests::samplePack());
  PackWriter::Options small;
  small.pageBytes = 600;
  EXPECT_EQ(tests::samplePack(small), tests::samplePack(small));
}

TEST(Pack, AnyPageSizeGivesTheSameContent) {
  const Pack one = openBytes(tests::samplePack());
  for (const std::uint32_t pageBytes : {1u, 128u, 600u, 5000u}) {
    PackWriter::Options options;
    options.pageBytes = pageBytes;
    const std::vector<std::byte> bytes = tests::samplePack(options);
    EXPECT_EQ(issuesOf(bytes), std::vector<std::string>{}) << pageBytes;
    const Pack pack = openBytes(bytes);
    EXPECT_GT(pack.pages().size(), one.pages().size());
    const Result<GridView> a = GridView::load(one, one.gridFrames()[0]);
    const Result<GridView> b = GridView::load(pack, pack.gridFrames()[0]);
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->leaves().size(), b->leaves().size());
    for (std::size_t i = 0; i < a->leaves().size(); ++i) {
      EXPECT_EQ(a->leaves()[i].node.brick, b->leaves()[i].node.brick);
      EXPECT_TRUE(std::equal(a->leaves()[i].brick.begin(), a->leaves()[i].brick.end(), b->leaves()[i].brick.begin()));
    }
  }
}

TEST(Pack, PageOfFindsClosedAndOpenPages) {
  const TempFolder folder;
  PackWriter::Options options;
  options.pageBytes = 64;
  PackWriter writer(folder / "a.blw", options);
  const std::vector<std::byte> unit(kBrickUnitBytes);
  const std::uint32_t child = 7;
  for (std::uint32_t i = 0; i < 7; ++i) {
    EXPECT_EQ(writer.append(Stream::unit, unit.data(), 1), i);
    EXPECT_EQ(writer.append(Stream::child, &child, 1), i);
  }
  // 36 bytes each: one pair fills a page to where the next unit does not fit.
  for (std::uint32_t i = 0; i < 7; ++i) {
    EXPECT_EQ(writer.pageOf(Stream::unit, i), i);
    EXPECT_EQ(writer.pageOf(Stream::child, i), i);
  }
}

TEST(GridView, VoxelEqualsDecodedBricksAndTiles) {
  const Pack pack = openBytes(tests::samplePack());
  for (const GridFrame& frame : pack.gridFrames()) {
    const Result<GridView> view = GridView::load(pack, frame);
    ASSERT_TRUE(view) << toString(view.error());
    for (const GridView::Leaf& leaf : view->leaves()) {
      Values values;
      Mask3 active;
      decodeBrick(leaf.node, leaf.mask, leaf.brick, frame.background, values, active);
      for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
        EXPECT_EQ(values[i],
                  view->voxel(leaf.origin[0] + (i >> 6), leaf.origin[1] + (i >> 3 & 7), leaf.origin[2] + (i & 7)));
      }
    }
    for (const GridView::Tile& tile : view->tiles()) {
      EXPECT_EQ(view->voxel(tile.origin[0], tile.origin[1], tile.origin[2]), tile.value);
      const std::uint32_t last = tile.dim - 1;
      EXPECT_EQ(view->voxel(tile.origin[0] + last, tile.origin[1] + last, tile.origin[2] + last), tile.value);
      EXPECT_EQ(view->voxel(std::int64_t{tile.origin[0]} - 1, tile.origin[1], tile.origin[2]), frame.background);
    }
    EXPECT_EQ(view->voxel(-1, 0, 0), frame.background);
    EXPECT_EQ(view->voxel(std::int64_t{1} << 40, 0, 0), frame.background);
  }
}

// The table of cells is only for boxes that it suits: far corners make the view search instead.
TEST(GridView, FindsBricksInAHugeBox) {
  const std::vector<std::byte> bytes = tests::writePack({}, [](PackWriter& writer) {
    PackTables tables = tests::sampleTables("far", {"density"}, 1);
    tests::GridFrameBuilder builder(writer, 0);
    builder.brick({0, 0, 0}, kEncodingConstant, {}, 1, 0, kMaskAll);
    builder.brick({511, 511, 511}, kEncodingConstant, {}, 2, 0, kMaskAll);
    builder.tile({7, 8, 9}, 3);
    tables.gridFrames.push_back(builder.finish(tables));
    return tables;
  });
  EXPECT_EQ(issuesOf(bytes), std::vector<std::string>{});
  const Pack pack = openBytes(bytes);
  const GridView view = *GridView::load(pack, pack.gridFrames()[0]);
  EXPECT_EQ(view.voxel(7, 7, 7), 1);
  EXPECT_EQ(view.voxel(8, 7, 7), 0);
  EXPECT_EQ(view.voxel(4088, 4095, 4090), 2);
  EXPECT_EQ(view.voxel(4087, 4095, 4090), 0);
  EXPECT_EQ(view.voxel(7 * 128 + 127, 8 * 128, 9 * 128 + 5), 3);
  EXPECT_EQ(view.voxel(7 * 128 + 128, 8 * 128, 9 * 128 + 5), 0);
}

TEST(Pack, UnfinishedFilesVanish) {
  const TempFolder folder;
  { const PackWriter writer(folder / "a.blw", {}); }
  EXPECT_TRUE(folder.empty());
  const PackWriter writer(folder / "b.blw", {});
  EXPECT_FALSE(folder.empty());
  removeUnfinishedFiles();
  EXPECT_TRUE(folder.empty());
}

TEST(Pack, RefusedPathsAreNamed) {
  const TempFolder folder;
  for (const std::string& path : {folder / "missing/a.blw", folder / "", std::string("/dev/null")}) {
    try {
      const PackWriter writer(path, {});
      ADD_FAILURE() << path << " was accepted";
    } catch (const std::system_error& error) {
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    }
  }
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

// A file size limit fails like a full disk: some write is refused.
TEST(Pack, RefusedWritesThrowAndLeaveNothing) {
  const TempFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const rlim_t limit : {rlim_t{0}, rlim_t{100}, rlim_t{70000}}) {
    const rlimit small{limit, before.rlim_max};
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    bool refused = false;
    try {
      PackWriter writer(folder / "a.blw", {});
      for (std::uint32_t i = 0; i < 40; ++i) writer.append(Stream::unit, tests::randomBytes(12800, i).data(), 200);
      writer.finish({});
    } catch (const std::system_error& error) {
      refused = std::string(error.what()).find(folder / "a.blw") != std::string::npos;
    }
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_TRUE(refused) << limit;
    EXPECT_TRUE(folder.empty()) << limit;
  }
  std::signal(SIGXFSZ, handler);
}

TEST(Pack, FinishedFileReplacesTheOld) {
  const TempFolder folder;
  for (const std::uint32_t frames : {1u, 3u}) {
    PackWriter writer(folder / "a.blw", {});
    PackTables tables = tests::sampleTables("v", {"density"}, frames);
    tables.gridFrames.assign(frames, tests::absentGridFrame());
    writer.finish(tables);
    const Result<Pack> pack = Pack::openFile(folder / "a.blw");
    ASSERT_TRUE(pack) << toString(pack.error());
    EXPECT_EQ(pack->frames().size(), frames);
  }
}

TEST(Pack, ClosedFilesHaveTheirSizeButNoNameYet) {
  const TempFolder folder;
  const std::string path = folder / "a.blw";
  PackTables tables = tests::sampleTables("v", {"density"}, 1);
  tables.gridFrames.assign(1, tests::absentGridFrame());
  { EXPECT_GT(PackWriter(path, {}).close(tables), 0u); }
  EXPECT_TRUE(folder.empty());
  PackWriter writer(path, {});
  const std::uint64_t size = writer.close(tables);
  EXPECT_FALSE(std::filesystem::exists(path));
  writer.commit();
  EXPECT_EQ(std::filesystem::file_size(path), size);
}

// Two grid frames of one root, and a third of another: what is shared counts once.
TEST(Pack, GpuBytesOfThePackCountWhatIsSharedOnce) {
  GridFrame first{};
  first.node5 = 0;
  first.activeMax[0] = first.activeMax[1] = first.activeMax[2] = 15;  // 2^3 cells
  first.tileCount = 1;
  GridFrame other = first;
  other.node5 = 1;
  GridFrame absent{};
  absent.node5 = kNone;
  const GridFrame frames[] = {first, first, other, absent};
  std::array<std::uint64_t, kStreamCount> stored{};
  stored[static_cast<std::size_t>(Stream::unit)] = 100;
  stored[static_cast<std::size_t>(Stream::mask)] = 10;
  stored[static_cast<std::size_t>(Stream::node3)] = 7;
  EXPECT_EQ(packGpuBytes(frames, stored), 100 * kBrickUnitBytes + 10 * 64 + 7 * 16 + 2 * (8 * 4 + 16));
}

TEST(Pack, UnreadablePathsAreIoIssues) {
  const TempFolder folder;
  for (const std::string& path : {folder / "missing.blw", folder / ""}) {
    const Result<Pack> pack = Pack::openFile(path);
    ASSERT_FALSE(pack);
    EXPECT_LT(pack.error().kind->id, 100);
  }
}

}  // namespace
}  // namespace billow
