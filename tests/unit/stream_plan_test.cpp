// What a streamer loads, gives up and draws, over a transport without a disk and without a device.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "fake_stream.h"
#include "stream/players.h"

namespace billow::tests {
namespace {

using runtime::AssetId;
using runtime::Drawable;
using runtime::InstanceId;
using runtime::Interpolation;
using runtime::Loop;
using runtime::Playback;

constexpr double kTick = 1.0 / 60;

std::uint32_t evenBricks(std::uint32_t) {
  return 16;
}

class StreamPlan : public testing::Test {
 protected:
  static AssetId open(FakeStream& stream, const PackFile& file) {
    const auto asset = stream->open({.path = file.path()});
    EXPECT_TRUE(asset) << asset.error().message;
    return asset.value_or(AssetId{});
  }

  static InstanceId add(FakeStream& stream, AssetId asset, const Playback& playback, double time = 0) {
    const auto id = stream->addInstance({.asset = asset, .time = time, .playback = playback});
    EXPECT_TRUE(id);
    return id.value_or(InstanceId{});
  }

  // Sum of weights, frames that live, and nothing that was given back.
  static void expectSound(FakeStream& stream, const Drawable& drawable) {
    float sum = 0;
    for (std::uint32_t i = 0; i < drawable.count; ++i) {
      const runtime::Layer& layer = drawable.layers[i];
      ASSERT_NE(layer.frame, nullptr);
      EXPECT_FALSE(stream.transport().isRetired(layer.frame));
      EXPECT_GE(layer.weight, 0);
      sum += layer.weight;
    }
    EXPECT_TRUE(drawable.count == 0 || std::abs(sum - 1) < 1e-5f) << sum;
  }

  static std::set<std::uint32_t> framesOf(FakeStream& stream, const Drawable& drawable) {
    std::set<std::uint32_t> frames;
    for (std::uint32_t i = 0; i < drawable.count; ++i) {
      frames.insert(stream.transport().known(drawable.layers[i].frame).frame);
    }
    return frames;
  }

  static std::uint64_t bytesOfAll(const PackFile& file) {
    const auto pack = *format::Pack::openFile(file.path());
    std::uint64_t bytes = 0;
    for (const format::GridFrame& grid : pack.gridFrames()) bytes += format::gpuBytes(grid).total() + 256;
    return bytes;
  }
};

TEST_F(StreamPlan, PlaysWithoutAHoldWhereAllFits) {
  const PackFile file(sequencePack(12, evenBricks));
  FakeStream stream;
  const InstanceId id = add(stream, open(stream, file), {});
  stream.update(20, 0);
  for (int i = 0; i < 200; ++i) {
    stream.update(kTick);
    const Drawable drawable = stream->drawable(id);
    expectSound(stream, drawable);
    EXPECT_FALSE(drawable.held) << "update " << i;
    EXPECT_FALSE(drawable.coarse) << "update " << i;
    const double frame = drawable.time * 24;
    for (const std::uint32_t shown : framesOf(stream, drawable)) {
      const double ahead = std::fmod(shown - frame + 24.0, 12.0);
      EXPECT_TRUE(ahead < 1 + 1e-6 || ahead > 11 - 1e-6) << shown << " at " << frame;
    }
  }
  EXPECT_EQ(stream->stats().framesResident, 12u + 1u) << "each frame once, and means of the first";
  EXPECT_FALSE(stream->takeError());
}

// Planning may be just swapping when a report is there: it is filled anew then, and nothing that it told is lost.
TEST_F(StreamPlan, NoticesOfAReportThatWasNotTakenGoFirst) {
  auto clip = std::make_shared<runtime::Clip>();
  clip->same = {0};
  clip->levels.resize(2);
  runtime::Players players;
  runtime::Report report;
  for (std::uint32_t number = 0; number < 4; ++number) {
    EXPECT_EQ(players.openClip(clip), number);
    players.fill(report);
    ASSERT_EQ(report.notices.size(), number + 1);
    for (std::uint32_t i = 0; i <= number; ++i) EXPECT_EQ(report.notices[i].clip, i);
  }
}

// Whatever comes, goes and changes, and however many reports are not taken.
TEST_F(StreamPlan, ReportsTellPlanningWhatThereIs) {
  const auto clip = std::make_shared<runtime::Clip>();
  clip->same = {0};
  clip->levels.resize(2);
  runtime::Players players;
  const std::uint32_t number = players.openClip(clip);
  runtime::Report report;
  runtime::Snapshot snapshot;
  std::mt19937 random(8);
  std::vector<InstanceId> ids;
  for (int i = 0; i < 3000; ++i) {
    const InstanceId any = ids.empty() ? InstanceId{} : ids[random() % ids.size()];
    switch (random() % 6) {
      case 0:
        ids.push_back(*players.add({.time = i * 0.01, .priority = static_cast<float>(i)}, number));
        break;
      case 1:
        players.remove(any);
        std::erase(ids, any);
        break;
      case 2:
        players.setPriority(any, static_cast<float>(random() % 100));
        break;
      case 3:
        players.setTransform(any, {1, 0, 0, i * 1.0, 0, 1, 0, 0, 0, 0, 1, 0});
        break;
      case 4:
        players.setPlayback(any, {.speed = i * 0.1, .loop = Loop::once});
        break;
      default:
        players.fill(report);
        if (random() % 2 == 0) break;
        snapshot.take(report);
        ASSERT_EQ(snapshot.instances.size(), players.views().size());
        for (std::size_t at = 0; at < snapshot.instances.size(); ++at) {
          const runtime::InstanceView &told = snapshot.instances[at], &is = players.views()[at];
          ASSERT_EQ(told.id.value, is.id.value) << i;
          ASSERT_EQ(told.priority, is.priority) << i;
          ASSERT_EQ(told.centre, is.centre) << i;
          ASSERT_EQ(told.playback.speed, is.playback.speed) << i;
          ASSERT_EQ(told.phase, is.phase) << i;
        }
    }
  }
}

// The short way gives what the long one gives, whenever it may be taken.
TEST_F(StreamPlan, GoingOnDrawsWhatChoosingAnewWould) {
  std::vector<format::FrameRecord> records(12);
  for (std::size_t i = 0; i < 12; ++i) records[i].time = static_cast<double>(i) / 24;
  const auto clip = std::make_shared<runtime::Clip>();
  clip->timeline = runtime::Timeline(records, 24);
  clip->same = {0, 1, 2, 3, 3, 5, 6, 7, 8, 9, 10, 11};
  clip->levels.resize(2);
  clip->velocity = true;
  runtime::Track track{.clip = clip, .slots = std::vector<runtime::Track::Slot>(24), .version = 1};
  std::mt19937 random(5);
  std::uint32_t shorter = 0;
  for (const Loop loop : {Loop::loop, Loop::pingPong, Loop::once}) {
    for (const Interpolation way : {Interpolation::hold, Interpolation::blend, Interpolation::advect}) {
      runtime::InstanceView view;
      view.playback = {.speed = 1, .loop = loop, .interpolation = way};
      runtime::Player player;
      runtime::Shown shown;
      for (int i = 0; i < 500; ++i) {
        if (random() % 20 == 0) {
          runtime::Track::Slot& slot = track.slots[random() % 24];
          slot.frame = slot.frame == nullptr ? std::make_unique<runtime::ResidentFrame>() : nullptr;
          ++track.version;
        }
        const double moved = random() % 50 == 0 ? 0.2 : 1.0 / 144;
        view.phase = wrapPhase(clip->timeline, loop, view.phase + moved);
        if (random() % 200 == 0) view.phase = clip->timeline.last();
        runtime::Player other = player;
        runtime::Shown wanted = shown;
        chooseLayers(track, view, other, wanted, moved, 1.0f / 144);
        if (!goOn(track, view, player, shown, 1.0f / 144)) {
          player = other;
          shown = wanted;
          continue;
        }
        ++shorter;
        ASSERT_EQ(shown.count, wanted.count) << i;
        ASSERT_EQ(shown.time, wanted.time) << i;
        ASSERT_EQ(shown.held, wanted.held) << i;
        ASSERT_EQ(shown.coarse, wanted.coarse) << i;
        ASSERT_EQ(player.near, other.near) << i;
        for (std::uint32_t layer = 0; layer < shown.count; ++layer) {
          ASSERT_EQ(shown.items[layer], wanted.items[layer]) << i;
          ASSERT_NEAR(shown.weights[layer], wanted.weights[layer], 1e-5f) << i;
          ASSERT_NEAR(shown.advect[layer], wanted.advect[layer], 1e-6f) << i;
          ASSERT_EQ(player.fades[layer].seen, other.fades[layer].seen) << i;
        }
      }
    }
  }
  EXPECT_GT(shorter, 400u);
}

TEST_F(StreamPlan, OnlyAShrunkBudgetTakesTheLastFrameOfAnInstance) {
  auto clip = std::make_shared<runtime::Clip>();
  clip->same = {0};
  clip->levels.resize(2);
  runtime::Players players;
  FakeTransport transport({}, {});
  ASSERT_TRUE(players.add({}, players.openClip(clip)));
  std::uint32_t drawn = 0;
  const auto change = [&](runtime::Change::Kind kind, std::unique_ptr<runtime::ResidentFrame> frame) {
    runtime::Change made{.kind = kind, .clip = 0, .item = 0, .instance = {}, .frame = std::move(frame)};
    players.take({&made, 1}, transport);
    players.advance(0);
    runtime::Report report;
    players.fill(report);
    drawn = report.moments[0].drawnCount;
    return std::move(report.notices);
  };
  change(runtime::Change::Kind::arrive, std::make_unique<runtime::ResidentFrame>());
  EXPECT_EQ(drawn, 1u);
  auto notices = change(runtime::Change::Kind::force, nullptr);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0].kind, runtime::Notice::Kind::refused);
  EXPECT_EQ(drawn, 1u);
  notices = change(runtime::Change::Kind::seize, nullptr);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0].kind, runtime::Notice::Kind::retired);
  EXPECT_EQ(drawn, 0u);
  for (int i = 0; i < 5; ++i) transport.update();
}

TEST_F(StreamPlan, TransformsThatAreNoNumbersAndHugeOnesAreBorne) {
  const PackFile file(sequencePack(4, evenBricks));
  FakeStream stream;
  const AssetId asset = open(stream, file);
  std::vector<InstanceId> ids;
  for (int i = 0; i < 40; ++i) ids.push_back(add(stream, asset, {.speed = 0}));
  for (int i = 0; i < 40; ++i) {
    std::array<double, 12> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const double values[] = {1e200, std::nan(""), 1e300, -1e308, 0, 1, HUGE_VAL};
    for (std::size_t at = 0; at < 12; ++at) {
      if (i % 3 != 0 || at % 4 == 3) transform[at] = values[(static_cast<std::size_t>(i) + at * (at % 3)) % 7];
    }
    stream->setTransform(ids[static_cast<std::size_t>(i)], transform);
  }
  for (int i = 0; i < 20; ++i) stream->update({.seconds = kTick, .view = runtime::View{}});
  for (const InstanceId id : ids) {
    expectSound(stream, stream->drawable(id));
    EXPECT_GT(stream->drawable(id).count, 0u);
  }
}

TEST_F(StreamPlan, ALostDeviceIsToldThoughLoadsFailedBefore) {
  const PackFile file(sequencePack(4, evenBricks));
  FakeStream stream;
  bool lost = false;
  stream.transport().fault = [&](const runtime::LoadOrder&) -> std::optional<runtime::Error> {
    return runtime::Error{.code = lost ? runtime::ErrorCode::vulkan : runtime::ErrorCode::memory, .message = "no"};
  };
  add(stream, open(stream, file), {.speed = 0});
  stream.update(10, kTick);
  while (const auto error = stream->takeError()) EXPECT_EQ(error->code, runtime::ErrorCode::memory);
  lost = true;
  stream.update(60, kTick);
  const auto error = stream->takeError();
  ASSERT_TRUE(error);
  EXPECT_EQ(error->code, runtime::ErrorCode::vulkan);
  EXPECT_EQ(error->message.find("tried again"), std::string::npos) << error->message;
  EXPECT_FALSE(stream->takeError());
}

TEST_F(StreamPlan, AReloadOfWhichNothingComesIsGivenUp) {
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

TEST_F(StreamPlan, AnAssetThatFailedIsOpenedByAReload) {
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

TEST_F(StreamPlan, BlendsByTheFraction) {
  const PackFile file(sequencePack(4, evenBricks));
  FakeStream stream;
  const InstanceId id = add(stream, open(stream, file), {.speed = 0}, 1.25 / 24);
  stream.update(60, kTick);
  const Drawable drawable = stream->drawable(id);
  ASSERT_EQ(drawable.count, 2u);
  EXPECT_EQ(stream.transport().known(drawable.layers[0].frame).frame, 1u);
  EXPECT_EQ(stream.transport().known(drawable.layers[1].frame).frame, 2u);
  EXPECT_NEAR(drawable.layers[0].weight, 0.75f, 1e-5f);
  EXPECT_NEAR(drawable.layers[1].weight, 0.25f, 1e-5f);
  stream->setPlayback(id, {.speed = 0, .interpolation = Interpolation::hold});
  stream.update();
  EXPECT_EQ(stream->drawable(id).count, 1u);
}

// From means to full detail within 0.2 seconds, in steps that are no larger than time is.
TEST_F(StreamPlan, LevelsFadeIntoOneAnother) {
  const PackFile file(sequencePack(4, evenBricks));
  FakeStream stream;
  bool slow = true;
  const InstanceId id = add(stream, open(stream, file), {.speed = 0});
  stream.transport().fault = [&](const runtime::LoadOrder& order) -> std::optional<runtime::Error> {
    if (order.means || !slow) return std::nullopt;
    return runtime::Error{.code = runtime::ErrorCode::memory, .message = "not yet"};
  };
  stream.update(6, kTick);
  Drawable drawable = stream->drawable(id);
  ASSERT_EQ(drawable.count, 1u);
  EXPECT_TRUE(drawable.coarse);
  EXPECT_TRUE(stream.transport().known(drawable.layers[0].frame).means);
  slow = false;
  float before = 0;
  int between = 0;
  for (int i = 0; i < 80; ++i) {
    stream.update(kTick);
    drawable = stream->drawable(id);
    expectSound(stream, drawable);
    float full = 0;
    for (std::uint32_t l = 0; l < drawable.count; ++l) {
      if (!stream.transport().known(drawable.layers[l].frame).means) full += drawable.layers[l].weight;
    }
    EXPECT_LE(full - before, static_cast<float>(kTick) / 0.2f + 1e-4f);
    EXPECT_GE(full, before);
    between += full > 0 && full < 1;
    before = full;
  }
  EXPECT_EQ(before, 1);
  EXPECT_GE(between, 10);
  EXPECT_FALSE(drawable.coarse);
}

TEST_F(StreamPlan, PrefetchesInPlayingOrder) {
  const PackFile file(sequencePack(40, evenBricks));
  struct Case {
    Playback playback;
    double time;
    std::vector<std::uint32_t> frames;  // that the full loads must begin with, after the moment's own
  };
  const Case cases[] = {
      {{.speed = 1}, 10 / 24.0, {12, 13, 14}}, {{.speed = 4}, 10 / 24.0, {12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22}},
      {{.speed = -1}, 10.5 / 24.0, {9, 8, 7}}, {{.speed = -4}, 2.5 / 24.0, {1, 0, 39, 38, 37}},
      {{.speed = 1}, 38 / 24.0, {0, 1, 2}},    {{.speed = 1, .loop = Loop::pingPong}, 37.5 / 24.0, {39, 36, 35}},
  };
  for (const Case& c : cases) {
    FakeStream stream;
    stream.transport().latency = 1000;
    add(stream, open(stream, file), c.playback, c.time);
    stream.update(0);
    std::vector<std::uint32_t> frames;
    for (const auto& [frame, means] : stream.transport().log) {
      if (!means) frames.push_back(frame);
    }
    ASSERT_GE(frames.size(), 2 + c.frames.size());
    const std::vector<std::uint32_t> next(frames.begin() + 2,
                                          frames.begin() + 2 + static_cast<std::ptrdiff_t>(c.frames.size()));
    EXPECT_EQ(next, c.frames) << "speed " << c.playback.speed << " from " << c.time;
  }
}

TEST_F(StreamPlan, EqualFramesAreLoadedOnce) {
  const PackFile file(writePack({}, [](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", {"density"}, 6);
    GridFrameBuilder builder(writer, 0);
    builder.brick({1, 1, 1}, format::kEncodingConstant, {}, 1, 0, format::kMaskAll);
    const format::GridFrame frame = builder.finish(tables);
    for (int i = 0; i < 6; ++i) tables.gridFrames.push_back(frame);
    for (std::uint32_t i = 1; i < 6; ++i) tables.frames[i].flags = format::kFrameHeld;
    return tables;
  }));
  FakeStream stream;
  const AssetId asset = open(stream, file);
  std::vector<InstanceId> ids;
  for (int i = 0; i < 50; ++i) ids.push_back(add(stream, asset, {.speed = 1 + i * 0.1}, i * 0.01));
  for (int i = 0; i < 40; ++i) {
    stream.update();
    for (const InstanceId id : ids) expectSound(stream, stream->drawable(id));
  }
  EXPECT_EQ(stream.transport().log.size(), 2u) << "its means, then itself";
  for (const InstanceId id : ids) EXPECT_EQ(stream->drawable(id).count, 1u);
}

TEST_F(StreamPlan, NothingIsLoadedWithoutPriority) {
  const PackFile file(sequencePack(12, evenBricks));
  FakeStream stream;
  const InstanceId id = add(stream, open(stream, file), {});
  stream->setPriority(id, 0);
  stream.update(20, kTick);
  EXPECT_TRUE(stream.transport().log.empty());
  EXPECT_EQ(stream->drawable(id).count, 0u);
  EXPECT_EQ(stream->stats().instances, 0u);
}

TEST_F(StreamPlan, AQuarterOfTheBudgetPlays) {
  const PackFile file(sequencePack(48, evenBricks));
  const std::uint64_t budget = bytesOfAll(file) / 4;
  for (const double speed : {1.0, -1.0, 4.0, -4.0}) {
    for (const Loop loop : {Loop::loop, Loop::pingPong}) {
      FakeStream stream({.gpuBudget = budget, .prefetchSeconds = 0.08});
      stream.transport().parallel = 16;
      const InstanceId id = add(stream, open(stream, file), {.speed = speed, .loop = loop}, 1);
      stream.update(20, 0);
      int late = 0;
      for (int i = 0; i < 400; ++i) {
        stream.update(kTick);
        const Drawable drawable = stream->drawable(id);
        expectSound(stream, drawable);
        late += drawable.held || drawable.coarse;
        EXPECT_LE(stream->stats().gpuAllocated, budget);
        EXPECT_LE(stream->stats().gpuBytes, budget + bytesOfAll(file) / 8);
      }
      EXPECT_EQ(late, 0) << "speed " << speed << ", loop " << static_cast<int>(loop);
    }
  }
}

// What is given back takes its memory for some updates yet, and what comes for some before it is drawn: where both do
// not fit at a speed, all is drawn coarser instead of half of it late.
TEST_F(StreamPlan, AFastLoopThatDoesNotFitIsCoarserButNeverLate) {
  const PackFile file(sequencePack(12, [](std::uint32_t frame) { return 60 + 8 * (frame % 7); }));
  for (const double share : {0.35, 0.5, 0.6}) {
    for (const double speed : {1.0, -1.0, 4.0, -4.0, 7.3}) {
      for (const Loop loop : {Loop::loop, Loop::pingPong}) {
        FakeStream stream({.gpuBudget = static_cast<std::uint64_t>(share * static_cast<double>(bytesOfAll(file)))});
        stream.transport().parallel = 16;
        const InstanceId id = add(stream, open(stream, file), {.speed = speed, .loop = loop});
        stream.update(60, kTick);
        int held = 0, turns = 0;
        bool before = false;
        for (int i = 0; i < 600; ++i) {
          stream.update(kTick);
          const Drawable drawable = stream->drawable(id);
          expectSound(stream, drawable);
          held += drawable.held;
          turns += drawable.coarse != before;
          before = drawable.coarse;
        }
        EXPECT_EQ(held, 0) << share << " of the frames at speed " << speed << ", loop " << static_cast<int>(loop);
        EXPECT_LE(turns, 12) << share << " of the frames at speed " << speed << ", loop " << static_cast<int>(loop);
      }
    }
  }
}

// A load that takes a second is late, but not too slow where enough of them are under way: its level is waited for.
TEST_F(StreamPlan, LatencyAloneTakesNoDetail) {
  const PackFile file(sequencePack(48, evenBricks));
  FakeStream stream({.gpuBudget = 4 * bytesOfAll(file), .prefetchSeconds = 2});
  stream.transport().latency = 60;
  stream.transport().parallel = 64;
  const InstanceId id = add(stream, open(stream, file), {});
  stream.update(1200, kTick);
  int coarse = 0;
  for (int i = 0; i < 240; ++i) {
    stream.update(kTick);
    coarse += stream->drawable(id).coarse || stream->drawable(id).held;
  }
  EXPECT_EQ(coarse, 0);
}

// What has ended needs its last frame, and not those before.
TEST_F(StreamPlan, WhatHasEndedIsAsFineAsItsFrameFits) {
  const PackFile file(sequencePack(12, [](std::uint32_t) { return 200; }));
  FakeStream stream({.gpuBudget = bytesOfAll(file) / 12 * 8 / 5});
  const InstanceId id = add(stream, open(stream, file), {.speed = 4, .loop = Loop::once});
  stream.update(60 * 40, kTick);
  EXPECT_GT(stream->drawable(id).count, 0u);
  EXPECT_FALSE(stream->drawable(id).coarse);
  EXPECT_FALSE(stream->drawable(id).held);
}

TEST_F(StreamPlan, FramesThatNeverComeAreLateOnceEach) {
  const PackFile file(sequencePack(12, evenBricks));
  FakeStream stream;
  stream.transport().fault = [](const runtime::LoadOrder&) -> std::optional<runtime::Error> {
    return runtime::Error{.code = runtime::ErrorCode::memory, .message = "none"};
  };
  add(stream, open(stream, file), {}, 0.003);
  std::uint32_t late = 0;
  for (int i = 0; i < 600; ++i) {
    stream.update(kTick);
    late += stream->stats().framesLate;
  }
  EXPECT_EQ(late, 241u) << "24 a second, and the first";
}

// A disk that cannot bring the full detail in time is no reason to hold.
TEST_F(StreamPlan, WhatComesTooLateIsDrawnCoarserAfterAWhile) {
  const PackFile file(sequencePack(120, evenBricks));
  FakeStream stream({.gpuBudget = bytesOfAll(file) / 2});
  stream.transport().parallel = 1;
  stream.transport().latency = 4;
  stream.transport().meansAreQuick = true;
  const InstanceId id = add(stream, open(stream, file), {}, 0.003);
  stream.update(240, kTick);
  int held = 0;
  std::uint32_t late = 0, told = 0;
  double wanted = 0.003 + 240 * kTick;
  for (int i = 0; i < 600; ++i) {
    const double before = wanted;
    wanted += kTick;
    stream.update(kTick);
    held += stream->drawable(id).held;
    late += stream->drawable(id).held && std::floor(wanted * 24) > std::floor(before * 24);
    told += stream->stats().framesLate;
  }
  EXPECT_LT(held, 30);
  EXPECT_EQ(told, late);
}

TEST_F(StreamPlan, ASeekShowsTheNewMomentSoonAndHoldsTheOldUntilThen) {
  const PackFile file(sequencePack(48, evenBricks));
  FakeStream stream({.gpuBudget = bytesOfAll(file) / 4});
  stream.transport().latency = 3;
  const InstanceId id = add(stream, open(stream, file), {});
  stream.update(60, kTick);
  std::mt19937 random(4);
  for (int seek = 0; seek < 30; ++seek) {
    const double to = std::uniform_real_distribution<double>(0, 2)(random);
    const double before = stream->drawable(id).time;
    stream->seek(id, to);
    int updates = 0;
    for (; updates < 12; ++updates) {
      stream.update(kTick);
      const Drawable drawable = stream->drawable(id);
      expectSound(stream, drawable);
      ASSERT_GT(drawable.count, 0u);
      if (!drawable.held) break;
      // The old moment, or one that was passed since the seek.
      if (drawable.time == before) continue;
      EXPECT_NEAR(drawable.time, to, 0.1);
      break;
    }
    EXPECT_LE(updates, 6) << "to " << to;
    stream.update(5, kTick);
  }
}

TEST_F(StreamPlan, ACorruptPageIsToldOnceAndTheRestPlaysOn) {
  const PackFile file(sequencePack(12, evenBricks));
  FakeStream stream;
  const auto pack = *format::Pack::openFile(file.path());
  stream.transport().fault = [](const runtime::LoadOrder& order) -> std::optional<runtime::Error> {
    if (order.frame != 5) return std::nullopt;
    return runtime::Error{.code = runtime::ErrorCode::pack, .message = "page 3: altered"};
  };
  const InstanceId id = add(stream, open(stream, file), {});
  bool shown[12] = {};
  double before = 0;
  for (int i = 0; i < 300; ++i) {
    stream.update(kTick);
    const Drawable drawable = stream->drawable(id);
    expectSound(stream, drawable);
    for (const std::uint32_t frame : framesOf(stream, drawable)) shown[frame] = true;
    EXPECT_LT(std::fmod(drawable.time - before + 0.5, 0.5), 0.06);
    before = drawable.time;
  }
  for (int frame = 0; frame < 12; ++frame) EXPECT_EQ(shown[frame], frame != 5) << frame;
  std::uint32_t errors = 0;
  while (const auto error = stream->takeError()) {
    EXPECT_EQ(error->frame, 5u);
    ++errors;
  }
  EXPECT_EQ(errors, 2u) << "of the frame, and of its means";
}

TEST_F(StreamPlan, ReadErrorsAreTriedAgainAndToldOnce) {
  const PackFile file(sequencePack(3, evenBricks));
  FakeStream stream;
  int failures = 0;
  stream.transport().fault = [&](const runtime::LoadOrder& order) -> std::optional<runtime::Error> {
    if (order.frame != 1 || order.means || ++failures > 3) return std::nullopt;
    return runtime::Error{.code = runtime::ErrorCode::memory, .message = "out of memory"};
  };
  const InstanceId id = add(stream, open(stream, file), {.speed = 0, .interpolation = Interpolation::hold}, 1.5 / 24);
  stream.update(180, kTick);
  EXPECT_EQ(failures, 4);
  EXPECT_FALSE(stream->drawable(id).coarse);
  EXPECT_TRUE(stream->takeError());
  EXPECT_FALSE(stream->takeError());
}

TEST_F(StreamPlan, ASmallerBudgetIsKeptAsSoonAsFramesInFlightAllow) {
  const PackFile file(sequencePack(24, evenBricks));
  FakeStream stream({.gpuBudget = 4 * bytesOfAll(file)});
  const InstanceId id = add(stream, open(stream, file), {});
  stream.update(120, kTick);
  const std::uint64_t budget = bytesOfAll(file) / 4;
  stream->setBudget(budget, 64u << 20);
  stream.update(10, kTick);
  for (int i = 0; i < 120; ++i) {
    stream.update(kTick);
    EXPECT_LE(stream->stats().gpuAllocated, budget);
    expectSound(stream, stream->drawable(id));
    EXPECT_GT(stream->drawable(id).count, 0u);
  }
  EXPECT_FALSE(stream->drawable(id).held);
}

// Detail is taken from what is least important, and does not flicker.
TEST_F(StreamPlan, UnderPressureTheLeastImportantIsCoarser) {
  const PackFile file(sequencePack(48, evenBricks));
  const std::uint64_t frame = bytesOfAll(file) / 48;
  FakeStream stream({.gpuBudget = 14 * frame});
  stream.transport().parallel = 16;
  const AssetId asset = open(stream, file);
  std::vector<InstanceId> ids;
  for (int i = 0; i < 8; ++i) {
    ids.push_back(add(stream, asset, {}, i * 0.25));
    stream->setPriority(ids.back(), static_cast<float>(1 << (8 - i)));
  }
  stream.update(240, kTick);
  std::vector<int> changes(8), coarse(8);
  std::vector<bool> before(8);
  for (int i = 0; i < 600; ++i) {
    stream.update(kTick);
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const Drawable drawable = stream->drawable(ids[k]);
      expectSound(stream, drawable);
      EXPECT_GT(drawable.count, 0u);
      bool means = false;
      for (std::uint32_t l = 0; l < drawable.count; ++l) {
        means = means || stream.transport().known(drawable.layers[l].frame).means;
      }
      EXPECT_EQ(drawable.coarse, means) << "it tells what the budget has taken";
      coarse[k] += means;
      changes[k] += means != before[k];
      before[k] = means;
    }
  }
  EXPECT_EQ(coarse[0], 0);
  EXPECT_EQ(coarse[1], 0);
  EXPECT_GT(coarse[6], 500);
  EXPECT_GT(coarse[7], 500);
}

TEST_F(StreamPlan, ReloadKeepsTimeAndSwapsWithoutAHole) {
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

TEST_F(StreamPlan, AFailedReloadLeavesAllAsItWas) {
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

TEST_F(StreamPlan, HandlesOfWhatIsGoneNameNothing) {
  const PackFile file(sequencePack(4, evenBricks));
  FakeStream stream;
  const AssetId asset = open(stream, file);
  const InstanceId first = add(stream, asset, {});
  stream->removeInstance(first);
  const InstanceId second = add(stream, asset, {});
  EXPECT_FALSE(first == second);
  stream.update(10, kTick);
  EXPECT_EQ(stream->drawable(first).count, 0u);
  EXPECT_GT(stream->drawable(second).count, 0u);
  stream->close(asset);
  EXPECT_EQ(stream->state(asset), runtime::Streamer::AssetState::unknown);
  EXPECT_EQ(stream->drawable(second).count, 0u);
  stream.update(10, kTick);
  EXPECT_EQ(stream.transport().used(), 0u);
  EXPECT_EQ(stream.transport().reserved(), 0u);
  const AssetId again = open(stream, file);
  EXPECT_FALSE(asset == again);
  EXPECT_FALSE(stream->addInstance({.asset = asset}));
}

// Whatever happens: budgets hold, weights sum to 1, no frame that was given back is drawn, no hole opens once something
// was drawn, the shown time goes with the play, and when all is quiet everything wanted is there.
TEST_F(StreamPlan, RandomScenarios) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    const auto pick = [&](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
    const auto uneven = [&](std::uint32_t frame) { return 1 + (frame * 7 + seed) % 23; };
    std::vector<std::unique_ptr<PackFile>> files;
    for (int i = pick(1, 3); i > 0; --i) {
      files.push_back(std::make_unique<PackFile>(sequencePack(static_cast<std::uint32_t>(pick(1, 30)), uneven)));
    }
    std::uint64_t all = 0;
    for (const auto& file : files) all += bytesOfAll(*file);
    const std::uint64_t full = all * 2;
    FakeStream stream({.gpuBudget = full});
    stream.transport().latency = static_cast<std::uint32_t>(pick(1, 6));
    stream.transport().parallel = static_cast<std::uint32_t>(pick(1, 8));
    std::vector<AssetId> assets;
    for (const auto& file : files) assets.push_back(open(stream, *file));
    struct Known {
      InstanceId id;
      AssetId asset;
      Playback playback;
      double shown = -1;
      double played = 0;    // volume seconds since the moment itself was shown
      bool sought = false;  // and the moment that was asked for has not been shown yet
    };
    std::vector<Known> known;
    std::uint64_t budget = full;
    int sinceBudget = 0;
    for (int step = 0; step < 400; ++step) {
      const bool quiet = step >= 330;
      if (!quiet && pick(0, 12) == 0 && known.size() < 12) {
        const AssetId asset = assets[static_cast<std::size_t>(pick(0, static_cast<int>(assets.size()) - 1))];
        Playback playback{.speed = pick(-4, 4) * 0.7,
                          .loop = static_cast<Loop>(pick(0, 2)),
                          .interpolation = static_cast<Interpolation>(pick(0, 2))};
        known.push_back({add(stream, asset, playback, pick(0, 100) * 0.02), asset, playback});
      }
      if (!known.empty() && !quiet) {
        Known& some = known[static_cast<std::size_t>(pick(0, static_cast<int>(known.size()) - 1))];
        if (pick(0, 20) == 0) {
          stream->seek(some.id, pick(0, 100) * 0.02);
          some.sought = true;
        }
        if (pick(0, 40) == 0) {
          some.playback.speed = pick(-4, 4) * 0.7;
          stream->setPlayback(some.id, some.playback);
        }
        if (pick(0, 60) == 0) {
          stream->removeInstance(some.id);
          some = known.back();
          known.pop_back();
        }
      }
      if (!quiet && pick(0, 80) == 0) {
        budget = full / static_cast<std::uint64_t>(pick(1, 8));
        stream->setBudget(budget, 64u << 20);
        sinceBudget = 0;
      }
      if (step == 330) {
        budget = full;
        stream->setBudget(budget, 64u << 20);
        for (Known& one : known) {
          one.playback.speed = 0;
          stream->setPlayback(one.id, one.playback);
        }
      }
      const double seconds = pick(0, 2) * kTick;
      stream.update(seconds);
      ++sinceBudget;
      EXPECT_TRUE(sinceBudget <= 80 || stream->stats().gpuAllocated <= budget) << "seed " << seed << " step " << step;
      for (Known& one : known) {
        const Drawable drawable = stream->drawable(one.id);
        expectSound(stream, drawable);
        one.played += std::abs(one.playback.speed) * seconds;
        if (drawable.count == 0) {
          EXPECT_TRUE(sinceBudget <= 80 || one.shown < 0) << "a hole, seed " << seed << " step " << step;
          continue;
        }
        // By no more than it played since, unless a seek asked for it.
        const double length = stream->pack(one.asset)->volumes()[0].frameCount / 24.0;
        const double moved = std::abs(drawable.time - one.shown);
        const double jump = one.playback.loop == Loop::loop ? std::min(moved, length - moved) : moved;
        if (one.shown >= 0 && !one.sought) {
          EXPECT_LE(jump, one.played + 2 / 24.0) << "seed " << seed << " step " << step;
        }
        if (!drawable.held) {
          one.played = 0;
          one.sought = false;
        }
        one.shown = drawable.time;
      }
      if (testing::Test::HasFailure()) return;
    }
    // Detail that the budget took comes back after some seconds.
    stream.update(60, 0.5);
    for (const Known& one : known) {
      EXPECT_FALSE(stream->drawable(one.id).held) << "seed " << seed;
      EXPECT_FALSE(stream->drawable(one.id).coarse) << "seed " << seed;
      EXPECT_GT(stream->drawable(one.id).count, 0u) << "seed " << seed;
    }
    EXPECT_FALSE(stream->takeError());
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace billow::tests
