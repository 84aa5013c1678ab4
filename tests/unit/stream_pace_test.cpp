// What is drawn where not everything fits or comes in time: coarser, or late.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "stream_plan_fixture.h"

namespace billow::tests {
namespace {

using StreamPace = StreamPlanning;

TEST_F(StreamPace, AQuarterOfTheBudgetPlays) {
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
TEST_F(StreamPace, AFastLoopThatDoesNotFitIsCoarserButNeverLate) {
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
TEST_F(StreamPace, LatencyAloneTakesNoDetail) {
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
TEST_F(StreamPace, WhatHasEndedIsAsFineAsItsFrameFits) {
  const PackFile file(sequencePack(12, [](std::uint32_t) { return 200; }));
  FakeStream stream({.gpuBudget = bytesOfAll(file) / 12 * 8 / 5});
  const InstanceId id = add(stream, open(stream, file), {.speed = 4, .loop = Loop::once});
  stream.update(60 * 40, kTick);
  EXPECT_GT(stream->drawable(id).count, 0u);
  EXPECT_FALSE(stream->drawable(id).coarse);
  EXPECT_FALSE(stream->drawable(id).held);
}

TEST_F(StreamPace, FramesThatNeverComeAreLateOnceEach) {
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
TEST_F(StreamPace, WhatComesTooLateIsDrawnCoarserAfterAWhile) {
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

// Detail is taken from what is least important, and does not flicker.
TEST_F(StreamPace, UnderPressureTheLeastImportantIsCoarser) {
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

}  // namespace
}  // namespace billow::tests
