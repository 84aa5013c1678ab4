// Detail levels in a pack: how readers find them, and what makes their tables unsound.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>

#include "pack_issues.h"

namespace billow {
namespace {

using namespace format;
using tests::PackImage;

PackImage withLevels() {
  PackImage image = PackImage::of(tests::sample());
  tests::addLevel(image, 1);
  tests::addLevel(image, 3);
  return image;
}

// The one issue that a change brings, found by validator and loader alike.
void expectLevelIssue(int id, const std::function<void(PackImage&)>& change) {
  PackImage image = withLevels();
  change(image);
  const std::vector<std::byte> bytes = image.assemble();
  std::string all;
  for (const Issue& issue : tests::issuesOf(bytes)) all += toString(issue) + "\n";
  EXPECT_EQ(tests::idsOf(bytes), std::multiset<int>{id}) << all;
  EXPECT_EQ(tests::loaderStop(bytes), id) << all;
}

TEST(Levels, AreFoundByTheirFullVolume) {
  const std::vector<std::byte> bytes = withLevels().assemble();
  EXPECT_EQ(tests::idsOf(bytes), std::multiset<int>{});
  const Pack pack = *Pack::open(makeMemorySource(bytes));
  ASSERT_EQ(pack.volumes().size(), 3u);
  EXPECT_FALSE(pack.isLevel(0));
  EXPECT_TRUE(pack.isLevel(1));
  EXPECT_TRUE(pack.isLevel(2));
  const auto levels = pack.levelsOf(0);
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_EQ(levels[0].level, 1u);
  EXPECT_EQ(levels[1].log2, 3u);
  EXPECT_TRUE(pack.levelsOf(1).empty());
  EXPECT_EQ(pack.levelError(levels[1], 1, 0).squaredError, 0.5 * 3);
}

TEST(Levels, AReaderThatDoesNotKnowThemFindsVolumes) {
  PackImage image = withLevels();
  image.levels.clear();
  image.levelErrors.clear();
  const std::vector<std::byte> bytes = image.assemble();
  EXPECT_EQ(tests::idsOf(bytes), std::multiset<int>{});
  const Pack pack = *Pack::open(makeMemorySource(bytes));
  EXPECT_EQ(pack.volumes().size(), 3u);
  EXPECT_FALSE(pack.isLevel(1));
}

TEST(Levels, TheirVolumesExistOnceEachAndInOrder) {
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].level = 3; });
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].volume = kNone; });
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].level = 1; });
  expectLevelIssue(240, [](PackImage& image) { image.levels[0].level = 0; });
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].volume = 1; });  // a level of a level
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].level = 0; });   // its full volume is the other's level
  expectLevelIssue(240, [](PackImage& image) { std::swap(image.levels[0].log2, image.levels[1].log2); });
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].log2 = 1; });
  expectLevelIssue(240, [](PackImage& image) { image.levels[0].log2 = 0; });
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].log2 = 5; });
  expectLevelIssue(240, [](PackImage& image) { image.levels[1].log2 = 0xffffffff; });
}

TEST(Levels, HoldWhatTheirVolumeHolds) {
  expectLevelIssue(241, [](PackImage& image) { image.volumes[1].look.anisotropy = 0.25f; });
  expectLevelIssue(241, [](PackImage& image) { image.volumes[2].framesPerSecond = 30; });
  expectLevelIssue(241, [](PackImage& image) { image.grids[2].role = 2; });
  expectLevelIssue(241, [](PackImage& image) { std::swap(image.grids[2].name, image.grids[3].name); });
  expectLevelIssue(241, [](PackImage& image) { image.frames[3].number += 1; });
  expectLevelIssue(241, [](PackImage& image) { image.frames[3].time += 1; });
  expectLevelIssue(241, [](PackImage& image) { image.frames[5].flags = kFrameHeld; });
  expectLevelIssue(241, [](PackImage& image) { image.gridFrames[5].flags = kGridPresent; });
  // The second level has no frames.
  expectLevelIssue(241, [](PackImage& image) {
    image.volumes[2].frameCount = 0;
    image.frames.resize(4);
    image.gridFrames.resize(8);
    image.levelErrors.resize(4);
  });
}

TEST(Levels, LieWhereTheirVolumeLies) {
  expectLevelIssue(242, [](PackImage& image) { image.gridFrames[4].indexToWorld[3] += 1e-6; });
  expectLevelIssue(242, [](PackImage& image) { image.gridFrames[4].indexToWorld[0] *= 1.0000001; });
  expectLevelIssue(242, [](PackImage& image) { image.gridFrames[4].origin[2] = 8; });
  PackImage moved = withLevels();
  const double voxel = moved.gridFrames[0].indexToWorld[5];
  moved.gridFrames[0].origin[1] = -8;
  // From -16 on, in voxels of two: 32 of the full volume's, which begins 8 of them down itself.
  moved.gridFrames[4].origin[1] = -16;
  moved.gridFrames[4].indexToWorld[7] -= 24 * voxel;
  moved.gridFrames[8].origin[1] = -8;  // voxels of eight
  moved.gridFrames[8].indexToWorld[7] -= 56 * voxel;
  EXPECT_EQ(tests::idsOf(moved.assemble()), std::multiset<int>{});
}

TEST(Levels, HaveErrors) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  expectLevelIssue(243, [](PackImage& image) { image.levelErrors.pop_back(); });
  expectLevelIssue(243, [](PackImage& image) { image.levelErrors.clear(); });
  expectLevelIssue(243, [](PackImage& image) { image.levels[1].firstError = 3; });
  expectLevelIssue(243, [](PackImage& image) { image.levelErrors[2].squaredError = -1; });
  expectLevelIssue(243, [](PackImage& image) { image.levelErrors[2].squaredError = kNan; });
  expectLevelIssue(243,
                   [](PackImage& image) { image.levelErrors[2].maxError = std::numeric_limits<float>::infinity(); });
  expectLevelIssue(215, [](PackImage& image) { image.levelErrors[2].reserved = 1; });
  PackImage alone = PackImage::of(tests::sample());
  alone.levelErrors.push_back({0, 0, 0});
  EXPECT_EQ(tests::idsOf(alone.assemble()), std::multiset<int>{243});
}

// Whatever else is wrong with the pack, no table is read beyond its end (the sanitizers watch).
TEST(Levels, RandomChangesOfAllTablesDoNoHarm) {
  std::mt19937 random(31);
  int opened = 0;
  for (int round = 0; round < 4000; ++round) {
    PackImage image = withLevels();
    for (auto change = random() % 3 + 1; change > 0; --change) {
      const auto flip = [&](auto& records) {
        const std::span<std::byte> bytes = std::as_writable_bytes(std::span(records));
        const std::size_t word = random() % (bytes.size() / 4);
        const std::uint32_t values[] = {0, 1, 2, 3, 0xffffffff, static_cast<std::uint32_t>(random())};
        std::memcpy(bytes.data() + 4 * word, &values[random() % 6], 4);
      };
      switch (random() % 6) {
        case 0:
          flip(image.volumes);
          break;
        case 1:
          flip(image.gridFrames);
          break;
        case 2:
          flip(image.grids);
          break;
        case 3:
          flip(image.levelErrors);
          break;
        default:
          flip(image.levels);
      }
    }
    const std::vector<std::byte> bytes = image.assemble();
    if (Pack::open(makeMemorySource(bytes)).has_value()) {
      ++opened;
      EXPECT_TRUE(tests::loaderStop(bytes) == 0 || tests::hasError(bytes));
    } else {
      EXPECT_TRUE(tests::hasError(bytes));
    }
  }
  EXPECT_GT(opened, 100);
}

TEST(Levels, WriterKeepsRoomForThem) {
  PackTables tables;
  tables.levels.push_back({0, 1, 1, 0});
  EXPECT_THROW(tests::writePack({}, [&](PackWriter&) { return tables; }), std::logic_error);
  PackWriter::Options options;
  options.levels = true;
  const auto bytes = tests::writePack(options, [&](PackWriter&) { return tables; });
  EXPECT_EQ(tests::idsOf(bytes), std::multiset<int>{240});  // written as given
}

TEST(Levels, EndPageBeginsAnother) {
  const auto bytes = tests::writePack({}, [&](PackWriter& writer) {
    const Mask3 mask{};
    EXPECT_EQ(writer.append(Stream::mask, &mask, 1), 0u);
    writer.endPage();
    writer.endPage();  // an empty page is none
    EXPECT_EQ(writer.append(Stream::mask, &mask, 1), 1u);
    EXPECT_EQ(writer.pageOf(Stream::mask, 0), 0u);
    EXPECT_EQ(writer.pageOf(Stream::mask, 1), 1u);
    return PackTables();
  });
  EXPECT_EQ(Pack::open(makeMemorySource(bytes))->pages().size(), 2u);
}

}  // namespace
}  // namespace billow
