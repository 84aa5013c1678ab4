// What an instance asks for of its pack - grids, a level - and what is told of its frames.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "fake_stream.h"
#include "pack_issues.h"

namespace billow::tests {
namespace {

using runtime::AssetId;
using runtime::GridChoice;
using runtime::InstanceId;
using runtime::kNotResident;

constexpr double kTick = 1.0 / 60;

// A volume with these grids; each frame of each has bricks of its own.
std::vector<std::byte> packOf(const std::vector<std::string>& grids, std::uint32_t frames = 6) {
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", grids, frames);
    std::uint32_t seed = 0;
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
      for (std::size_t grid = 0; grid < grids.size(); ++grid) {
        GridFrameBuilder builder(writer, 0);
        for (std::uint32_t i = 0; i < 8; ++i) {
          builder.brick({i, 0, 0}, format::uniformEncoding(8), randomBytes(512, ++seed), 0.01f, 0.1f, format::kMaskAll);
        }
        tables.gridFrames.push_back(builder.finish(tables));
      }
    }
    return tables;
  });
}

// With voxels twice as wide as a level, which is volume 1.
std::vector<std::byte> packWithLevel() {
  PackImage image = PackImage::of(packOf({"density"}));
  addLevel(image, 1);
  return image.assemble();
}

class StreamInstance : public testing::Test {
 protected:
  AssetId open(const PackFile& file) {
    const auto asset = stream_->open({.path = file.path()});
    EXPECT_TRUE(asset) << asset.error().message;
    return asset.value_or(AssetId{});
  }
  InstanceId add(const runtime::InstanceInfo& info) {
    const auto id = stream_->addInstance(info);
    EXPECT_TRUE(id) << id.error().message;
    return id.value_or(InstanceId{});
  }
  // What it draws, of any frame.
  FakeFrame drawn(InstanceId id) {
    const runtime::Drawable drawable = stream_->drawable(id);
    EXPECT_GT(drawable.count, 0u);
    return drawable.count > 0 ? stream_.transport().known(drawable.layers[0].frame) : FakeFrame{};
  }
  std::vector<std::uint8_t> residency(InstanceId id, std::size_t frames) {
    std::vector<std::uint8_t> levels(frames, 77);
    stream_->residency(id, levels);
    return levels;
  }

  FakeStream stream_;
};

TEST_F(StreamInstance, DrawsTheGridsThatItAsksFor) {
  const PackFile file(packOf({"density", "flames"}));
  const AssetId asset = open(file);
  const std::uint64_t tables = stream_.transport().reserved();
  const GridChoice usual{.extinction = 0, .flames = 1}, swapped{.extinction = 1};
  const InstanceId first = add({.asset = asset}), second = add({.asset = asset, .grids = swapped});
  stream_.update(60, kTick);
  EXPECT_EQ(drawn(first).grids, usual);
  EXPECT_EQ(drawn(second).grids, swapped);
  EXPECT_EQ(stream_->stats().framesResident, 2 * (6u + 1u)) << "what draws other grids shares nothing";

  const InstanceId third = add({.asset = asset, .grids = usual}), fourth = add({.asset = asset, .grids = swapped});
  stream_.update(1, kTick);
  EXPECT_GT(stream_->drawable(third).count, 0u) << "it shares what is there";
  EXPECT_EQ(drawn(fourth).grids, swapped);

  EXPECT_FALSE(stream_->addInstance({.asset = asset, .grids = GridChoice{.extinction = 2}}));
  EXPECT_GT(stream_.transport().reserved(), tables);
  stream_->removeInstance(second);
  stream_.update(60, kTick);
  EXPECT_EQ(drawn(fourth).grids, swapped);
  stream_->removeInstance(fourth);
  stream_.update(60, kTick);
  EXPECT_EQ(stream_->stats().framesResident, 6u + 1u) << "nobody draws the others any more";
  EXPECT_EQ(stream_.transport().reserved(), tables);
  stream_->close(asset);
  stream_.update(10, kTick);
  EXPECT_EQ(stream_.transport().reserved(), 0u);
  EXPECT_FALSE(stream_->takeError());
}

TEST_F(StreamInstance, AReloadKeepsGridsByTheirNames) {
  const PackFile before(packOf({"density", "flames", "steam"})), after(packOf({"flames", "density"}));
  const AssetId asset = open(before);
  const InstanceId usual = add({.asset = asset});
  const InstanceId other = add({.asset = asset, .grids = GridChoice{.extinction = 1, .temperature = 2}});
  stream_.update(30, kTick);
  ASSERT_TRUE(stream_->reload(asset, {.path = after.path()}));
  stream_.update(3, kTick);
  const InstanceId late = add({.asset = asset, .grids = GridChoice{.flames = 0}});
  stream_.update(60, kTick);
  EXPECT_EQ(drawn(usual).grids, (GridChoice{.extinction = 1, .flames = 0}));
  EXPECT_EQ(drawn(other).grids, (GridChoice{.extinction = 0})) << "and the one that is gone is left out";
  EXPECT_GT(stream_->drawable(late).count, 0u);
  EXPECT_FALSE(stream_->takeError());
  stream_->close(asset);
  stream_.update(10, kTick);
  EXPECT_EQ(stream_.transport().used(), 0u);
  EXPECT_EQ(stream_.transport().reserved(), 0u);
}

TEST_F(StreamInstance, ALevelPlaysAlone) {
  const PackFile file(packWithLevel());
  const AssetId asset = open(file);
  const InstanceId full = add({.asset = asset}), coarse = add({.asset = asset, .volume = 1});
  EXPECT_FALSE(stream_->addInstance({.asset = asset, .volume = 2}));
  for (int i = 0; i < 120; ++i) {
    stream_.update(kTick);
    if (stream_->drawable(coarse).count == 0) continue;
    EXPECT_EQ(drawn(coarse).volume, 1u) << "update " << i;
  }
  EXPECT_EQ(drawn(full).volume, 0u);
  EXPECT_FALSE(drawn(coarse).means);

  // A pack without that level cannot take its place.
  const PackFile plain(packOf({"density"}));
  ASSERT_TRUE(stream_->reload(asset, {.path = plain.path()}));
  stream_.update(30, kTick);
  const auto error = stream_->takeError();
  ASSERT_TRUE(error);
  EXPECT_NE(error->message.find("volume 1"), std::string::npos) << error->message;
  EXPECT_EQ(drawn(coarse).volume, 1u);
  stream_->removeInstance(coarse);
  ASSERT_TRUE(stream_->reload(asset, {.path = plain.path()})) << "and without its instance it may";
  stream_.update(30, kTick);
  EXPECT_EQ(stream_->pack(asset)->volumes().size(), 1u);
}

TEST_F(StreamInstance, OtherGridsOutliveADevice) {
  const PackFile file(packOf({"density", "flames"}));
  const AssetId asset = open(file);
  const InstanceId id = add({.asset = asset, .grids = GridChoice{.extinction = 1}});
  stream_.update(30, kTick);
  EXPECT_GT(stream_->drawable(id).count, 0u);
  stream_->detach();
  const auto added = stream_->addInstance({.asset = asset, .grids = GridChoice{.flames = 0}});
  ASSERT_TRUE(added);
  stream_->removeInstance(id);
  stream_.update(3, kTick);
  EXPECT_EQ(stream_->drawable(*added).count, 0u);
}

TEST_F(StreamInstance, ToldWhichFramesAreResidentAndHowFine) {
  const PackFile file(packOf({"density"}, 12));
  const AssetId asset = open(file);
  const InstanceId id = add({.asset = asset, .playback = {.speed = 0}});
  EXPECT_EQ(residency(id, 12), std::vector<std::uint8_t>(12, kNotResident));
  stream_.update(20, kTick);
  std::vector<std::uint8_t> first(14, kNotResident);
  first[0] = 0;
  EXPECT_EQ(residency(id, 14), first) << "what stands needs its frame alone; there are no more than 12";
  EXPECT_EQ(residency(id, 0), std::vector<std::uint8_t>{});
  stream_->setPlayback(id, {.speed = 1});
  stream_.update(120, kTick);
  EXPECT_EQ(residency(id, 12), std::vector<std::uint8_t>(12, 0));
  EXPECT_EQ(residency(InstanceId{}, 2), std::vector<std::uint8_t>(2, kNotResident));

  // Too little for a frame as it is: means, of voxels 2^3 as wide.
  const PackFile large(sequencePack(4, [](std::uint32_t) { return 256u; }));
  FakeStream tight({.gpuBudget = 64u << 10});
  const auto coarse = tight->addInstance({.asset = *tight->open({.path = large.path()})});
  ASSERT_TRUE(coarse);
  tight.update(60, kTick);
  std::vector<std::uint8_t> levels(4);
  tight->residency(*coarse, levels);
  EXPECT_EQ(std::set<std::uint8_t>(levels.begin(), levels.end()), std::set<std::uint8_t>{3});
}

TEST_F(StreamInstance, ALevelIsToldByItsOwnVoxels) {
  const PackFile file(packWithLevel());
  const InstanceId coarse = add({.asset = open(file), .volume = 1});
  stream_.update(60, kTick);
  EXPECT_EQ(residency(coarse, 6), std::vector<std::uint8_t>(6, 0));
}

}  // namespace
}  // namespace billow::tests
