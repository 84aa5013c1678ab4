// Seconds to frames, and what comes next, at any speed and in any mode.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "stream/playback.h"

namespace billow::tests {
namespace {

using runtime::Interpolation;
using runtime::Loop;
using runtime::Moment;
using runtime::Timeline;

Timeline timelineOf(const std::vector<double>& times, float rate = 10) {
  std::vector<format::FrameRecord> frames;
  for (const double time : times) frames.push_back({static_cast<std::int32_t>(frames.size()), 0, time});
  return Timeline(frames, rate);
}

Timeline even(std::uint32_t frames) {
  std::vector<double> times;
  for (std::uint32_t i = 0; i < frames; ++i) times.push_back(i / 10.0);
  return timelineOf(times);
}

Moment at(const Timeline& timeline, Loop loop, double phase) {
  return momentAt(timeline, loop, wrapPhase(timeline, loop, phase), 0);
}

std::vector<std::uint32_t> coming(const Timeline& timeline, const runtime::Playback& playback, double phase,
                                  double horizon, std::vector<double>* when = nullptr) {
  std::vector<std::uint32_t> frames;
  comingFrames(timeline, playback, phase, horizon, [&](std::uint32_t frame, double seconds) {
    frames.push_back(frame);
    if (when != nullptr) when->push_back(seconds);
  });
  return frames;
}

TEST(Playback, LoopGoesFromTheLastFrameToTheFirst) {
  const Timeline timeline = even(4);
  const Moment moment = at(timeline, Loop::loop, 0.375);
  EXPECT_EQ(moment.a, 3u);
  EXPECT_EQ(moment.b, 0u);
  EXPECT_NEAR(moment.fraction, 0.75f, 1e-6f);
  EXPECT_NEAR(moment.untilB, 0.025, 1e-12);
  EXPECT_EQ(at(timeline, Loop::loop, 0.4).a, 0u);
  EXPECT_EQ(at(timeline, Loop::loop, -0.05).a, 3u);
}

TEST(Playback, OnceHoldsBothEnds) {
  const Timeline timeline = even(4);
  for (const double phase : {0.31, 1.0, 1e9}) {
    const Moment moment = at(timeline, Loop::once, phase);
    EXPECT_EQ(moment.a, 3u);
    EXPECT_EQ(moment.b, 3u);
    EXPECT_EQ(moment.time, timeline.last());
  }
  EXPECT_EQ(at(timeline, Loop::once, -5).a, 0u);
  EXPECT_EQ(at(timeline, Loop::once, -5).time, 0);
}

TEST(Playback, PingPongTurnsRoundAtTheLastFrame) {
  const Timeline timeline = even(4);
  EXPECT_EQ(at(timeline, Loop::pingPong, 0.35).a, 2u);
  EXPECT_NEAR(at(timeline, Loop::pingPong, 0.35).time, 0.25, 1e-12);
  EXPECT_EQ(at(timeline, Loop::pingPong, 0.55).a, 0u);
  EXPECT_NEAR(at(timeline, Loop::pingPong, 0.65).time, 0.05, 1e-12);
  EXPECT_EQ(at(timeline, Loop::pingPong, 0.3).b, 3u);
}

TEST(Playback, OneFrameIsAlwaysThatFrame) {
  const Timeline timeline = even(1);
  for (const Loop loop : {Loop::once, Loop::loop, Loop::pingPong}) {
    for (const double phase : {-3.0, 0.0, 0.05, 7.3}) {
      EXPECT_EQ(at(timeline, loop, phase).a, 0u);
      EXPECT_EQ(at(timeline, loop, phase).b, 0u);
    }
  }
}

TEST(Playback, UnevenTimesAreFollowed) {
  const Timeline timeline = timelineOf({0, 0.5, 0.6, 2});
  EXPECT_EQ(timeline.length(), 2.1);
  EXPECT_EQ(at(timeline, Loop::loop, 0.25).fraction, 0.5f);
  EXPECT_EQ(at(timeline, Loop::loop, 0.55).a, 1u);
  EXPECT_EQ(at(timeline, Loop::loop, 1.3).a, 2u);
  EXPECT_NEAR(at(timeline, Loop::loop, 1.3).fraction, 0.5f, 1e-6f);
}

// Times may be equal, and may begin anywhere.
TEST(Playback, EqualTimesShowTheLaterFrame) {
  const Timeline timeline = timelineOf({3, 3, 4, 4, 4, 5});
  EXPECT_EQ(at(timeline, Loop::loop, 0).a, 1u);
  EXPECT_EQ(at(timeline, Loop::loop, 1).a, 4u);
  EXPECT_EQ(at(timeline, Loop::loop, 0.999).b, 2u);
  EXPECT_EQ(timeline.last(), 2);
}

TEST(Playback, AHintChangesNothing) {
  const Timeline timeline = timelineOf({0, 0.5, 0.6, 0.6, 2});
  std::mt19937 random(1);
  for (int i = 0; i < 2000; ++i) {
    const double time = std::uniform_real_distribution<double>(0, 2.2)(random);
    const std::uint32_t expected = timeline.frameAt(time, 99);
    for (std::uint32_t near = 0; near < 6; ++near) EXPECT_EQ(timeline.frameAt(time, near), expected) << time;
  }
}

// A week at 144 updates a second is as exact as the first second.
TEST(Playback, StaysExactOverDays) {
  const Timeline timeline = even(7);
  const double step = 1.0 / 144;
  double phase = 0;
  for (std::uint64_t i = 0; i < 144ull * 3600; ++i) phase = wrapPhase(timeline, Loop::loop, phase + step);
  const double expected = std::fmod(3600.0, timeline.length());
  const double off = std::abs(phase - expected);
  EXPECT_LT(std::min(off, timeline.length() - off), 1e-8);
  EXPECT_NEAR(wrapPhase(timeline, Loop::loop, 7 * 86400 + 0.25), std::fmod(7 * 86400 + 0.25, 0.7), 1e-9);
}

TEST(Playback, WrappedPhasesLieInTheirPeriod) {
  std::mt19937 random(2);
  const Timeline timeline = timelineOf({0, 0.5, 0.6, 2});
  for (int i = 0; i < 5000; ++i) {
    const double phase = std::uniform_real_distribution<double>(-1e4, 1e4)(random);
    EXPECT_GE(wrapPhase(timeline, Loop::loop, phase), 0);
    EXPECT_LT(wrapPhase(timeline, Loop::loop, phase), timeline.length());
    EXPECT_LT(wrapPhase(timeline, Loop::pingPong, phase), 2 * timeline.last());
    const Moment moment = at(timeline, Loop::pingPong, phase);
    EXPECT_GE(moment.fraction, 0);
    EXPECT_LT(moment.fraction, 1);
  }
}

TEST(Playback, PingPongSeeksKeepTheirDirection) {
  const Timeline timeline = even(4);
  EXPECT_NEAR(phaseAt(timeline, Loop::pingPong, 0.1, 0.05), 0.1, 1e-12);
  EXPECT_NEAR(phaseAt(timeline, Loop::pingPong, 0.1, 0.5), 0.5, 1e-12);
  EXPECT_NEAR(phaseAt(timeline, Loop::pingPong, 9, 0.5), 0.3, 1e-12);
}

TEST(Playback, WhatComesNext) {
  const Timeline timeline = even(5);
  using Frames = std::vector<std::uint32_t>;
  std::vector<double> when;
  EXPECT_EQ(coming(timeline, {.speed = 1}, 0.25, 0.3, &when), (Frames{4, 0, 1}));
  EXPECT_NEAR(when[0], 0.05, 1e-12);
  EXPECT_NEAR(when[2], 0.25, 1e-12);
  EXPECT_EQ(coming(timeline, {.speed = 4}, 0.25, 0.05), (Frames{4, 0}));
  EXPECT_EQ(coming(timeline, {.speed = -1}, 0.25, 0.3), (Frames{1, 0, 4}));
  EXPECT_EQ(coming(timeline, {.speed = 1, .loop = Loop::once}, 0.25, 9), (Frames{4, 4}));
  EXPECT_EQ(coming(timeline, {.speed = -1, .loop = Loop::once}, 0.25, 9), (Frames{1, 0}));
  EXPECT_EQ(coming(timeline, {.speed = 1, .loop = Loop::pingPong}, 0.25, 0.4), (Frames{4, 3, 2, 1}));
  EXPECT_EQ(coming(timeline, {.speed = -1, .loop = Loop::pingPong}, 0.15, 0.3), (Frames{0, 1, 2}));
  EXPECT_EQ(coming(timeline, {.speed = 0}, 0.25, 9), (Frames{}));
  EXPECT_EQ(coming(timeline, {.speed = 1, .interpolation = Interpolation::hold}, 0.25, 0.2), (Frames{3, 4}));
  EXPECT_EQ(coming(timeline, {.speed = -1, .interpolation = Interpolation::hold}, 0.25, 0.2), (Frames{1, 0}));
}

// Whatever plays, every frame that a later moment needs was announced before, and in time.
TEST(Playback, EveryFrameIsAnnouncedBeforeItIsNeeded) {
  std::mt19937 random(3);
  for (int round = 0; round < 400; ++round) {
    std::vector<double> times{0};
    const int frames = std::uniform_int_distribution(1, 9)(random);
    while (static_cast<int>(times.size()) < frames) {
      times.push_back(times.back() + std::uniform_real_distribution<double>(0.02, 0.3)(random));
    }
    const Timeline timeline = timelineOf(times);
    runtime::Playback playback{.speed = std::uniform_real_distribution<double>(-4, 4)(random),
                               .loop = static_cast<Loop>(random() % 3),
                               .interpolation = static_cast<Interpolation>(random() % 2)};
    const double phase = wrapPhase(timeline, playback.loop, std::uniform_real_distribution<double>(0, 3)(random));
    const bool hold = playback.interpolation == Interpolation::hold;
    const double horizon = 0.5;
    std::vector<double> when;
    std::vector<std::uint32_t> list = coming(timeline, playback, phase, horizon, &when);
    const Moment now = momentAt(timeline, playback.loop, phase, 0);
    list.insert(list.end(), {now.a, now.b});
    when.insert(when.end(), {0.0, 0.0});
    for (double seconds = 0; seconds < horizon; seconds += 0.01) {
      const Moment then = at(timeline, playback.loop, phase + seconds * playback.speed);
      for (const std::uint32_t frame : {then.a, hold ? then.a : then.b}) {
        bool announced = false;
        for (std::size_t i = 0; i < list.size(); ++i) {
          announced = announced || (list[i] == frame && when[i] <= seconds + 1e-9);
        }
        EXPECT_TRUE(announced || then.fraction < 1e-6f)
            << "frame " << frame << " after " << seconds << " s at speed " << playback.speed << ", round " << round;
      }
    }
  }
}

}  // namespace
}  // namespace billow::tests
