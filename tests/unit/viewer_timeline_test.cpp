// The viewer's time line: where playing, stepping and seeking lead, in every loop and direction.
#include <gtest/gtest.h>

#include <vector>

#include "timeline.h"

namespace billow::viewer {
namespace {

// Four frames from number 7 on, a quarter of a second each, the first at 1 s.
Timeline quarters() {
  return Timeline({{1, 7}, {1.25, 8}, {1.5, 9}, {1.75, 11}}, 2);
}

std::int32_t numberOf(const Timeline& timeline) {
  return timeline.ticks()[timeline.tick()].number;
}

TEST(Timeline, BeginsPlayingAtTheFirstFrame) {
  const Timeline timeline = quarters();
  EXPECT_TRUE(timeline.playing());
  EXPECT_EQ(timeline.time(), 1);
  EXPECT_EQ(numberOf(timeline), 7);
}

TEST(Timeline, LoopsRoundInBothDirections) {
  Timeline timeline = quarters();
  timeline.advance(0.9);
  EXPECT_EQ(numberOf(timeline), 11);
  timeline.advance(0.2);
  EXPECT_NEAR(timeline.time(), 1.1, 1e-12);
  timeline.setSpeed(-2);
  timeline.advance(0.1);
  EXPECT_NEAR(timeline.time(), 1.9, 1e-12);
  EXPECT_EQ(timeline.velocity(), -2);
  timeline.advance(7.25);  // many rounds at once
  EXPECT_NEAR(timeline.time(), 1.4, 1e-9);
}

// As runtime::Loop::pingPong does: at the beginnings of the first and last frames.
TEST(Timeline, TurnsAtBothEndsOfPingPong) {
  Timeline timeline = quarters();
  timeline.setLoop(Loop::pingPong);
  timeline.advance(0.7);
  timeline.advance(0.2);
  EXPECT_NEAR(timeline.time(), 1.6, 1e-12);
  EXPECT_EQ(timeline.velocity(), -1);
  timeline.advance(1.0);
  EXPECT_NEAR(timeline.time(), 1.4, 1e-12);
  EXPECT_EQ(timeline.velocity(), 1);
  timeline.advance(1.75);  // to the end, back, and on
  EXPECT_NEAR(timeline.time(), 1.65, 1e-9);
  EXPECT_EQ(timeline.velocity(), 1);
  timeline.seek(1.9);  // which no ping-pong passes
  timeline.advance(0.1);
  EXPECT_NEAR(timeline.time(), 1.65, 1e-9);
  EXPECT_EQ(timeline.velocity(), -1);

  Timeline still({{1, 7}}, 2);
  still.setLoop(Loop::pingPong);
  still.advance(0.3);
  EXPECT_EQ(still.time(), 1);
}

// However long a picture takes, what shows is a moment of the sequence.
TEST(Timeline, StaysWithinItsEnds) {
  for (const Loop loop : {Loop::once, Loop::loop, Loop::pingPong}) {
    for (const double speed : {-4.0, -0.3, 0.0, 0.7, 4.0}) {
      Timeline timeline = quarters();
      timeline.setLoop(loop);
      timeline.setSpeed(speed);
      for (int i = 0; i < 1000; ++i) {
        timeline.advance(0.013 * (i % 40));
        ASSERT_GE(timeline.time(), 1);
        ASSERT_LT(timeline.time(), 2);
      }
    }
  }
}

TEST(Timeline, OnceStopsAtItsLastFrameAndPlaysAgain) {
  Timeline timeline = quarters();
  timeline.setLoop(Loop::once);
  timeline.advance(5);
  EXPECT_FALSE(timeline.playing());
  EXPECT_EQ(timeline.velocity(), 0);
  EXPECT_EQ(numberOf(timeline), 11);
  timeline.play();
  EXPECT_EQ(timeline.time(), 1);
  timeline.setSpeed(-1);
  timeline.advance(1);
  EXPECT_EQ(numberOf(timeline), 7);
  timeline.play();
  EXPECT_EQ(numberOf(timeline), 11);
}

TEST(Timeline, StepsPauseAndGoRound) {
  Timeline timeline = quarters();
  timeline.advance(0.3);
  timeline.step(1);
  EXPECT_FALSE(timeline.playing());
  EXPECT_EQ(timeline.time(), 1.5);
  timeline.step(2);
  EXPECT_EQ(numberOf(timeline), 7);
  timeline.step(-1);
  EXPECT_EQ(numberOf(timeline), 11);
  timeline.setLoop(Loop::once);
  timeline.step(1);
  EXPECT_EQ(numberOf(timeline), 11);
  timeline.step(-9);
  EXPECT_EQ(numberOf(timeline), 7);
}

TEST(Timeline, HoldsWhilePausedAndClampsWhatIsAskedFor) {
  Timeline timeline = quarters();
  timeline.pause();
  timeline.advance(3);
  EXPECT_EQ(timeline.time(), 1);
  timeline.seek(99);
  EXPECT_LT(timeline.time(), 2);
  EXPECT_EQ(numberOf(timeline), 11);
  timeline.seek(-99);
  EXPECT_EQ(timeline.time(), 1);
  timeline.setSpeed(1000);
  EXPECT_EQ(timeline.speed(), kMostSpeed);
  timeline.setSpeed(-1000);
  EXPECT_EQ(timeline.speed(), -kMostSpeed);
}

// Thirds of a second are no binary fractions.
TEST(Timeline, EveryStepOfManyShowsItsOwnFrame) {
  std::vector<Tick> ticks;
  for (std::int32_t i = 0; i < 1000; ++i) ticks.push_back({i / 3.0, i});
  Timeline timeline(ticks, 1000 / 3.0);
  for (std::int32_t i = 1; i < 1000; ++i) {
    timeline.step(1);
    ASSERT_EQ(numberOf(timeline), i);
  }
}

TEST(Timeline, CountsWhatCannotBeForeseen) {
  Timeline timeline = quarters();
  timeline.advance(0.4);
  EXPECT_EQ(timeline.jumps(), 0u);
  timeline.seek(1.5);
  EXPECT_EQ(timeline.jumps(), 1u);
  timeline.advance(0.7);
  EXPECT_EQ(timeline.jumps(), 2u);
  EXPECT_EQ(timeline.seeks(), 1u) << "the loop leads back by itself";
  timeline.setLoop(Loop::pingPong);
  EXPECT_EQ(timeline.seeks(), 2u);
}

}  // namespace
}  // namespace billow::viewer
