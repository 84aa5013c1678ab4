// The rules of nodes and bricks, and of what a grid frame says of its tree.
#include <gtest/gtest.h>

#include <limits>

#include "pack_issues.h"

namespace billow {
namespace {

using namespace format;
using namespace tests;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Node5& root(PackImage& image) {
  return *image.item<Node5>(Stream::node5, image.gridFrames[0].node5);
}
// The Node4s of the sample's first grid frame: 0 is the tile, 1 and 2 have bricks.
Node4& node4(PackImage& image, std::uint32_t index) {
  return *image.item<Node4>(Stream::node4, index);
}
// Its Node3s: 0 BC7, 1 coarse, 2 uniform 3, 3 uniform 16, 4 constant, 5 local 4, 6 uniform 8.
Node3& node3(PackImage& image, std::uint32_t index) {
  return *image.item<Node3>(Stream::node3, index);
}

TEST(TreeRules, Nodes) {
  expectIssue(401, [](PackImage& i) { root(i).childBegin = 1000; });
  expectIssue(401, [](PackImage& i) { node4(i, 1).childBegin = 0xffffffffu; });
  expectIssue(402, [](PackImage& i) { root(i).flags |= 2; });
  expectIssue(404, [](PackImage& i) { node4(i, 1).mean = 1e9f; });
  expectIssue(404, [](PackImage& i) { root(i).tile = 1e9f; });
  expectIssue(405, [](PackImage& i) { *i.item<std::uint32_t>(Stream::child, node4(i, 1).childBegin) = 1000; });
  expectIssue(406, [](PackImage& i) { node4(i, 2).max = node4(i, 2).mean; });
  expectIssue(407, [](PackImage& i) { node4(i, 1).flags = kNodeTileActive; });
  expectIssue(408, [](PackImage& i) { node4(i, 1).tile = -0.5f; });
  PackImage nan = PackImage::of(sample());
  node4(nan, 1).max = kNan;
  EXPECT_EQ(idsOf(nan.assemble()), (std::multiset<int>{403, 404}));
  EXPECT_EQ(loaderStop(nan.assemble()), 403);
}

TEST(TreeRules, Bricks) {
  expectIssue(501, [](PackImage& i) { node3(i, 0).brick = kEncodingCount << kEncodingShift; });
  expectIssue(502, [](PackImage& i) { node3(i, 0).brick |= 0x07fffff0u; });
  expectIssue(502, [](PackImage& i) { node3(i, 4).brick = 1; });
  expectIssue(503, [](PackImage& i) { node3(i, 0).mask = 77; });
  expectIssue(503, [](PackImage& i) { node3(i, 1).mask = kMaskTexel; });
  expectIssue(504, [](PackImage& i) { node3(i, 0).lo = kNan; });
  expectIssue(504, [](PackImage& i) { node3(i, 3).scale = 3e34f; });
  expectIssue(505, [](PackImage& i) { node3(i, 4).scale = 1; });
  expectIssue(506, [](PackImage& i) { node3(i, 2).mean = -0.5f; });
  expectIssue(506, [](PackImage& i) { node3(i, 0).mean = 1; });
  expectIssue(503, [](PackImage& i) { node3(i, 4).mask = kMaskTexel; });
  expectIssue(507, [](PackImage& i) { node3(i, 2).brick += 1; });
  expectIssue(507, [](PackImage& i) {
    node3(i, 5).brick = node3(i, 0).brick + ((localEncoding(4) - kEncodingBc7Y) << kEncodingShift);
  });
  expectIssue(507, [](PackImage& i) { node3(i, 6).brick = kEncodingUniform8 << kEncodingShift | unitOf(node3(i, 3)); });
}

TEST(TreeRules, Constants) {
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].node4Count; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].node3Count; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].maskCount; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].childCount; });
  expectIssue(601, [](PackImage& i) { ++i.gridFrames[0].tileCount; });
  for (std::uint32_t c = 0; c < kBrickClassCount; ++c) {
    expectIssue(601, [&](PackImage& i) { ++i.gridFrames[0].brickCount[c]; });
    expectIssue(601, [&](PackImage& i) { ++i.gridFrames[0].brickUnits[c]; });
  }
  expectIssue(602, [](PackImage& i) { ++i.gridFrames[0].activeVoxels; });
  expectIssue(603, [](PackImage& i) { ++i.gridFrames[0].activeMin[0]; });
  expectIssue(603, [](PackImage& i) { --i.gridFrames[0].activeMax[2]; });
  expectIssue(604, [](PackImage& i) { --i.gridFrames[0].activeMin[0]; });
  expectIssue(605, [](PackImage& i) { i.gridFrames[0].valueMax = 1; });
}

}  // namespace
}  // namespace billow
