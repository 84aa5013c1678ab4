// What a streamer loads, gives up and draws, over a transport without a disk and without a device.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "stream_plan_fixture.h"

namespace billow::tests {
namespace {

using StreamPlan = StreamPlanning;

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
