// Where the viewer's clocks send a streamer: to the frames that `billow render` draws.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "clock.h"
#include "pack_issues.h"

namespace billow::viewer {
namespace {

using command::AfterLast;
using command::FrameShare;

constexpr std::uint32_t kFrames = 6;
constexpr double kRate = 24;  // a second

class ViewerClock : public testing::Test {
 protected:
  ViewerClock() {
    auto bytes = tests::writePack({}, [](format::PackWriter&) {
      format::PackTables tables = tests::sampleTables("v", {"density"}, kFrames);
      for (std::uint32_t frame = 0; frame < kFrames; ++frame) tables.gridFrames.push_back(tests::absentGridFrame());
      return tables;
    });
    pack_ = std::move(*format::Pack::open(format::makeMemorySource(std::move(bytes))));
    request_.volumes.resize(1);
    request_.scene = true;
  }

  command::PlacedVolume placed(std::optional<std::uint32_t> still = {}) const {
    return {
        .request = &request_.volumes[0], .pack = &*pack_, .number = 0, .grids = {}, .suggested = {}, .still = still};
  }
  // The scene at a moment, playing.
  Clock at(double time) {
    line_.seek(time);
    return clockOf(placed(), request_, line_);
  }
  // The frame that a streamer shows there.
  static std::uint32_t frameOf(const Clock& clock) {
    double time = clock.time;
    if (clock.playback.loop == Loop::loop) time = std::fmod(time, kFrames / kRate);
    std::uint32_t frame = 0;
    while (frame + 1 < kFrames && (frame + 1) / kRate <= time) ++frame;
    return frame;
  }

  std::optional<format::Pack> pack_;
  command::RenderRequest request_;
  Timeline line_ = Timeline({{0, 0}}, 100);
};

TEST_F(ViewerClock, ShowsTheFramesThatARenderedPictureShows) {
  command::VolumeRequest& volume = request_.volumes[0];
  for (const AfterLast after : {AfterLast::hold, AfterLast::loop, AfterLast::vanish}) {
    for (const double rate : {12.0, kRate, 30.0}) {
      for (const double begin : {0.0, 0.4, 1.0 / 3}) {
        volume.after = after;
        volume.framesPerSecond = rate;
        volume.begin = begin;
        for (int i = 0; i < 400; ++i) {
          // Between frames, and exactly where they begin.
          const double time = i % 2 == 0 ? i / 97.0 : begin + (i - 20) / rate;
          if (time < 0) continue;
          const auto shares = placed().framesAt(time, runtime::Interpolation::hold);
          const Clock clock = at(time);
          ASSERT_EQ(clock.shown, !shares.empty()) << time;
          if (!shares.empty()) {
            ASSERT_EQ(frameOf(clock), shares[0].frame) << time;
          }
        }
      }
    }
  }
}

TEST_F(ViewerClock, GoesOnAtTheScenesSpeedAndWaitsAtItsEnds) {
  request_.volumes[0].begin = 2;
  request_.volumes[0].framesPerSecond = 12;
  line_.setSpeed(3);
  EXPECT_EQ(at(2.1).playback.speed, 1.5);
  EXPECT_EQ(at(2.1).part, Clock::Part::within);
  EXPECT_NEAR(at(2.1).time, 0.05, 1e-9);
  EXPECT_EQ(at(1.9).playback.speed, 0);
  EXPECT_EQ(at(1.9).time, 0);
  EXPECT_FALSE(at(1.9).shown);
  EXPECT_TRUE(at(1.9).wanted) << "it is loaded before it shows";
  EXPECT_FALSE(at(0.5).wanted);
  EXPECT_EQ(at(5).part, Clock::Part::after);
  EXPECT_EQ(at(5).playback.speed, 0);
  EXPECT_TRUE(at(5).shown);
  request_.volumes[0].after = AfterLast::loop;
  EXPECT_EQ(at(5).playback.speed, 1.5);
  EXPECT_EQ(at(5).playback.loop, Loop::loop);
  line_.pause();
  EXPECT_EQ(at(5).playback.speed, 0);
}

// A pack alone is the time line's own: the streamer goes round as it does.
TEST_F(ViewerClock, APackPlaysByItself) {
  request_.scene = false;
  request_.interpolate = runtime::Interpolation::advect;
  line_.setLoop(Loop::pingPong);
  line_.setSpeed(-2);
  const Clock clock = at(0.1);
  EXPECT_EQ(clock.playback.speed, -2);
  EXPECT_EQ(clock.playback.loop, Loop::pingPong);
  EXPECT_EQ(clock.playback.interpolation, runtime::Interpolation::advect);
  line_.pause();
  EXPECT_EQ(at(0.1).playback.speed, 0);
}

TEST_F(ViewerClock, AStillStands) {
  line_.seek(3);
  const Clock clock = clockOf(placed(4), request_, line_);
  EXPECT_EQ(clock.playback.speed, 0);
  EXPECT_EQ(clock.playback.interpolation, runtime::Interpolation::hold);
  EXPECT_EQ(frameOf(clock), 4u);
  EXPECT_TRUE(clock.shown);
}

}  // namespace
}  // namespace billow::viewer
