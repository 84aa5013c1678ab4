// The rules of the tables: each has a pack that breaks it and no other.
#include <gtest/gtest.h>

#include <limits>

#include "pack_issues.h"

namespace billow {
namespace {

using namespace format;
using namespace tests;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(TableRules, Names) {
  expectIssue(202, [](PackImage& i) { i.strings += '\xff'; });
  expectIssue(202, [](PackImage& i) { i.strings += "\xed\xa0\x80"; });
  expectIssue(203, [](PackImage& i) { i.volumes[0].name.size = 1000; });
  expectIssue(203, [](PackImage& i) { i.grids[0].name.offset = 0xffffffffu; });
  expectIssue(203, [](PackImage& i) { i.strings += "\xc3\xa4", i.volumes[0].name = {StringRef{18, 1}}; });
  expectIssue(204, [](PackImage& i) { i.volumes[0].name.size = 0; });
  expectIssue(204, [](PackImage& i) { i.strings[0] = '\n'; });
  expectIssue(205, [](PackImage& i) { i.grids[1].name = i.grids[0].name; });
}

// Opening reads no provenance; asking for it checks it.
TEST(TableRules, Info) {
  PackImage image = PackImage::of(sample());
  image.info.assign(1, '\xff');
  const std::vector<std::byte> bytes = image.assemble();
  EXPECT_EQ(idsOf(bytes), std::multiset<int>{227});
  const Result<Pack> pack = Pack::open(makeMemorySource(bytes));
  ASSERT_TRUE(pack);
  ASSERT_FALSE(pack->infoJson());
  EXPECT_EQ(pack->infoJson().error().kind->id, 227);
}

TEST(TableRules, Volumes) {
  expectIssue(206, [](PackImage& i) { i.volumes[0].gridCount = 1; });
  expectIssue(206, [](PackImage& i) { i.volumes[0].firstFrame = 1; });
  expectIssue(206, [](PackImage& i) { i.volumes[0].frameCount = 0xffffffffu; });
  expectIssue(207, [](PackImage& i) { i.volumes[0].framesPerSecond = 0; });
  expectIssue(207, [](PackImage& i) { i.volumes[0].framesPerSecond = kNan; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.set |= 0x80; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.anisotropy = 1; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.ambient[2] = 1; });
  expectIssue(208, [](PackImage& i) { i.volumes[0].look.extinctionScale = kInf; });
  expectIssue(215, [](PackImage& i) { i.volumes[0].look.reserved[3] = 1; });
}

// What the standard allows at the edges of its ranges.
TEST(TableRules, EdgesOfWhatIsAllowed) {
  PackImage image = PackImage::of(sample());
  image.volumes[0].look.extinctionScale = std::numeric_limits<float>::max();
  image.volumes[0].look.ambient[0] = -0.0f;  // not set: 0 by number
  for (GridFrame& frame : image.gridFrames) {
    if (frame.background == 0) frame.background = -0.0f;  // and tiles are +0
  }
  EXPECT_EQ(idsOf(image.assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(image.assemble()), 0);
}

// No volumes at all, a volume without frames, and one without grids.
TEST(TableRules, NothingInIt) {
  const PackImage nothing;
  EXPECT_EQ(idsOf(nothing.assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(nothing.assemble()), 0);
  PackImage noFrames = PackImage::of(smallestPack());
  noFrames.volumes[0].frameCount = 0;
  noFrames.frames.clear();
  noFrames.gridFrames.clear();
  EXPECT_EQ(idsOf(noFrames.assemble()), std::multiset<int>{});
  PackImage noGrids = PackImage::of(smallestPack());
  noGrids.volumes[0].gridCount = 0;
  noGrids.grids.clear();
  noGrids.gridFrames.clear();
  EXPECT_EQ(idsOf(noGrids.assemble()), std::multiset<int>{});
  EXPECT_EQ(loaderStop(noGrids.assemble()), 0);
}

TEST(TableRules, GridsAndFrames) {
  expectIssue(209, [](PackImage& i) { i.grids[0].volume = 1; });
  expectIssue(210, [](PackImage& i) { i.grids[0].role = kRoleCount; });
  expectIssue(211, [](PackImage& i) { i.grids[0].sourceType = kSourceTypeCount; });
  expectIssue(211, [](PackImage& i) { i.grids[0].component = 0; });
  expectIssue(211, [](PackImage& i) { i.grids[0].sourceType = 7; });
  expectIssue(215, [](PackImage& i) { i.grids[0].reserved[1] = 1; });
  expectIssue(212, [](PackImage& i) { i.frames[1].number = 7; });
  expectIssue(213, [](PackImage& i) { i.frames[1].time = -1; });
  expectIssue(213, [](PackImage& i) { i.frames[1].time = std::numeric_limits<double>::infinity(); });
  expectIssue(214, [](PackImage& i) { i.frames[0].flags = kFrameHeld; });
  expectIssue(214, [](PackImage& i) { i.frames[1].flags = 4; });
  expectIssue(226, [](PackImage& i) { i.gridFrames[0].flags = 0; });
}

TEST(TableRules, GridFrames) {
  expectIssue(215, [](PackImage& i) { i.gridFrames[0].reserved = 1; });
  expectIssue(215, [](PackImage& i) { i.gridFrames[0].reserved2 = 1; });
  expectIssue(216, [](PackImage& i) { i.gridFrames[0].flags |= 2; });
  expectIssue(217, [](PackImage& i) { i.gridFrames[0].indexToWorld[5] = 0; });
  expectIssue(217, [](PackImage& i) { i.gridFrames[0].indexToWorld[3] = std::numeric_limits<double>::quiet_NaN(); });
  expectIssue(218, [](PackImage& i) { i.gridFrames[0].maxError = -1; });
  expectIssue(218, [](PackImage& i) { i.gridFrames[0].squaredError = std::numeric_limits<double>::infinity(); });
  expectIssue(218, [](PackImage& i) { i.gridFrames[0].sourceMin = kNan; });
  expectIssue(218, [](PackImage& i) { i.gridFrames[1].valueMin = 1; });
  expectIssue(219, [](PackImage& i) { i.gridFrames[0].activeMax[1] = 4096; });
  expectIssue(219, [](PackImage& i) {
    i.gridFrames[1].activeMax[1] = 4, i.gridFrames[1].activeMax[0] = 0, i.gridFrames[1].activeMax[2] = 0;
  });
  expectIssue(217, [](PackImage& i) {  // a determinant of 8e-324, whose reciprocal no binary64 holds
    for (const int axis : {0, 5, 10}) i.gridFrames[0].indexToWorld[axis] = 2e-108;
  });
  expectIssue(220, [](PackImage& i) { i.gridFrames[0].origin[2] = -4; });
  expectIssue(220,
              [](PackImage& i) { i.gridFrames[0].origin[1] = 0x7ffffff8 - (i.gridFrames[0].activeMax[1] & ~7) + 8; });
  expectIssue(221, [](PackImage& i) { i.gridFrames[1].maskCount = 1; });
  expectIssue(222, [](PackImage& i) { i.gridFrames[3].pageListCount = 0xffffffffu; });
  expectIssue(223, [](PackImage& i) {
    i.pageLists.insert(i.pageLists.begin() + 1, 0), ++i.gridFrames[0].pageListCount, ++i.gridFrames[2].pageListBegin,
        ++i.gridFrames[3].pageListBegin;
  });
  expectIssue(224, [](PackImage& i) { i.pageLists[2] = 1; });
  expectIssue(225, [](PackImage& i) { i.gridFrames[0].node5 = 3; });
}

}  // namespace
}  // namespace billow
