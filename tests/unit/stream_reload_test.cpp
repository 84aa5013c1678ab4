// Packs that take the place of others while they play.
#include <gtest/gtest.h>

#include <vector>

#include "stream_plan_fixture.h"

namespace billow::tests {
namespace {

using StreamReload = StreamPlanning;

TEST_F(StreamReload, AReloadOfWhichNothingComesIsGivenUp) {
  const PackFile old(sequencePack(4, evenBricks)), fresh(sequencePack(4, evenBricks));
  FakeStream stream;
  const AssetId asset = open(stream, old);
  const InstanceId id = add(stream, asset, {});
  stream.update(20, kTick);
  const format::Pack* const pack = stream->pack(asset);
  stream.transport().fault = [&](const runtime::LoadOrder& order) -> std::optional<runtime::Error> {
    if (&order.pack->pack == pack) return std::nullopt;
    return runtime::Error{.code = runtime::ErrorCode::memory, .message = "not now"};
  };
  ASSERT_TRUE(stream->reload(asset, {.path = fresh.path()}));
  stream.update(20 * 60, kTick);
  stream.update(1, 40.0);
  EXPECT_FALSE(stream->reload(asset, {.path = fresh.path()})) << "it is still tried, though the game hung for once";
  stream.update(11 * 60, kTick);
  EXPECT_EQ(stream->pack(asset), pack);
  EXPECT_GT(stream->drawable(id).count, 0u);
  EXPECT_TRUE(stream->takeError());
  stream.transport().fault = nullptr;
  ASSERT_TRUE(stream->reload(asset, {.path = fresh.path()}));
  stream.update(60, kTick);
  EXPECT_NE(stream->pack(asset), pack);
}

TEST_F(StreamReload, AnAssetThatFailedIsOpenedByAReload) {
  const PackFile file(std::vector<std::byte>(100));
  FakeStream stream;
  const auto asset = stream->openLater({.path = file.path()});
  ASSERT_TRUE(asset);
  stream.update();
  EXPECT_EQ(stream->state(*asset), runtime::Streamer::AssetState::failed);
  EXPECT_TRUE(stream->takeError());
  file.write(sequencePack(4, evenBricks));
  ASSERT_TRUE(stream->reload(*asset, {.path = file.path()}));
  EXPECT_FALSE(stream->reload(*asset, {.path = file.path()})) << "it is being opened";
  stream.update();
  EXPECT_EQ(stream->state(*asset), runtime::Streamer::AssetState::ready);
  const InstanceId id = add(stream, *asset, {});
  stream.update(10, kTick);
  EXPECT_GT(stream->drawable(id).count, 0u);
}

TEST_F(StreamReload, ReloadKeepsTimeAndSwapsWithoutAHole) {
  const PackFile old(sequencePack(12, evenBricks));
  const PackFile fresh(sequencePack(24, evenBricks));
  FakeStream stream;
  const AssetId asset = open(stream, old);
  const InstanceId id = add(stream, asset, {});
  stream.update(40, kTick);
  const format::Pack* before = stream->pack(asset);
  ASSERT_TRUE(stream->reload(asset, {.path = fresh.path()}));
  int updates = 0;
  for (; updates < 30 && stream->pack(asset) == before; ++updates) {
    stream.update(kTick);
    EXPECT_GT(stream->drawable(id).count, 0u);
    EXPECT_FALSE(stream->drawable(id).held);
    expectSound(stream, stream->drawable(id));
  }
  EXPECT_LT(updates, 20);
  EXPECT_EQ(stream->pack(asset)->frames().size(), 24u);
  double latest = 0;
  for (int i = 0; i < 60; ++i) {
    stream.update(kTick);
    latest = std::max(latest, stream->drawable(id).time);
  }
  EXPECT_GT(latest, 0.9) << "it plays on past the end of the old one";
  EXPECT_FALSE(stream->takeError());
}

TEST_F(StreamReload, AFailedReloadLeavesAllAsItWas) {
  const PackFile old(sequencePack(12, evenBricks));
  std::vector<std::byte> bytes = sequencePack(12, evenBricks);
  bytes[200] ^= std::byte{1};
  const PackFile bad(bytes);
  FakeStream stream;
  const AssetId asset = open(stream, old);
  const InstanceId id = add(stream, asset, {});
  stream.update(40, kTick);
  const format::Pack* before = stream->pack(asset);
  ASSERT_TRUE(stream->reload(asset, {.path = bad.path()}));
  for (int i = 0; i < 60; ++i) {
    stream.update(kTick);
    EXPECT_FALSE(stream->drawable(id).held);
  }
  EXPECT_EQ(stream->pack(asset), before);
  EXPECT_TRUE(stream->takeError());
  EXPECT_FALSE(stream->takeError());
  EXPECT_TRUE(stream->reload(asset, {.path = old.path()})) << "and it may be tried again";
}

}  // namespace
}  // namespace billow::tests
