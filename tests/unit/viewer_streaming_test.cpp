// `billow view` streams what it shows: scrubbing, a small budget, chosen grids, packs that are written anew.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "viewer_window.h"

namespace billow::tests {
namespace {

// The time line's strip of frames.
constexpr std::uint32_t kStripLeft = 8, kStripWidth = 160, kStripY = 230;
constexpr double kSeconds = 6 / 24.0;  // of the sample fire

class ViewerStreaming : public ViewerWindow {
 protected:
  // While it is paused.
  void stepTo(int number) {
    do {
      const int before = frame();
      screen_.hand("key Right");
      ASSERT_TRUE(eventually([&] { return frame() != before; }));
    } while (frame() != number);
  }
  // How much redder than green the strip is at a frame: the coarser it is resident, the more.
  int coarseness(std::uint32_t frame) const {
    const std::uint32_t x = kStripLeft + (2 * frame + 1) * kStripWidth / 12 + 4;
    const Shot shot = screen_.look(x + 1, kStripY + 1);
    return int{shot.at(x, kStripY)[0]} - shot.at(x, kStripY)[1];
  }
};

TEST_F(ViewerStreaming, ScrubbingEndsInThePictureOfItsMoment) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35"));
  ASSERT_NO_FATAL_FAILURE(start());
  ASSERT_NO_FATAL_FAILURE(pause());
  std::string drag = "mousemove 20 230 mousedown 1";
  for (const int x : {150, 40, 90, 160, 12, 70, 127}) drag += " mousemove " + std::to_string(x) + " 230 sleep 0.1";
  screen_.hand(drag + " mousemove 128 230 sleep 1 mouseup 1");
  moveAway();
  ASSERT_TRUE(eventually([&] { return frame() == 11; })) << title();  // 4.5 frames after number 7
  EXPECT_TRUE(paused());
  Shot shown, rendered;
  ASSERT_NO_FATAL_FAILURE(shoot(shown));
  const double time = (128.0 - kStripLeft) / kStripWidth * kSeconds;
  ASSERT_NO_FATAL_FAILURE(render(scene_, "--interpolate blend --time " + std::to_string(time), rendered));
  EXPECT_GT(burning(shown), 400u);
  EXPECT_LE(difference(shown, rendered).largest, 2);
  quit();
}

TEST_F(ViewerStreaming, PlaysOnInAQuarterOfTheMemory) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35"));
  ASSERT_NO_FATAL_FAILURE(start("--frame-budget 120K"));
  moveAway();
  ASSERT_NO_FATAL_FAILURE(watchPlay(4, 300, [](const Shot& shot) {
    const std::uint8_t* pixel = shot.at(14, 14);
    EXPECT_FALSE(pixel[0] > 60 && pixel[1] < 40) << "an error is told";
  }));
  bool coarser = false;
  ASSERT_TRUE(eventually([&] {
    for (std::uint32_t i = 0; i < 6; ++i) coarser |= coarseness(i) > -30;
    return coarser;
  })) << "the strip tells of frames that are absent or coarse";
  quit();
}

TEST_F(ViewerStreaming, TheStripTellsWhatIsResident) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35"));
  ASSERT_NO_FATAL_FAILURE(start());
  moveAway();
  EXPECT_TRUE(eventually([&] {
    bool fine = true;
    for (std::uint32_t i = 0; i < 6; ++i) fine &= coarseness(i) < -40;
    return fine;
  })) << "all of it fits";
  quit();
}

TEST_F(ViewerStreaming, DrawsTheGridsThatTheSceneChooses) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35", R"(, "grids": {"extinction": "flame", "flames": "none"})"));
  ASSERT_NO_FATAL_FAILURE(start());
  moveAway();
  ASSERT_NO_FATAL_FAILURE(pause());
  ASSERT_NO_FATAL_FAILURE(stepTo(10));
  Shot shown, rendered, usual;
  ASSERT_NO_FATAL_FAILURE(shoot(shown));
  ASSERT_NO_FATAL_FAILURE(render(scene_, "--frame 10", rendered));
  EXPECT_LE(difference(shown, rendered).largest, 2);
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35"));
  ASSERT_NO_FATAL_FAILURE(render(scene_, "--frame 10", usual));
  EXPECT_GT(difference(shown, usual).mean, 1);
  quit();
}

TEST_F(ViewerStreaming, DrawsTheLevelThatTheSceneAsksFor) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35 --levels 2", R"(, "level": 2)"));
  ASSERT_NO_FATAL_FAILURE(start());
  moveAway();
  ASSERT_NO_FATAL_FAILURE(pause());
  ASSERT_NO_FATAL_FAILURE(stepTo(10));
  Shot shown, rendered;
  ASSERT_NO_FATAL_FAILURE(shoot(shown));
  ASSERT_NO_FATAL_FAILURE(render(scene_, "--frame 10", rendered));
  EXPECT_GT(burning(shown), 300u);
  EXPECT_LE(difference(shown, rendered).largest, 2);
  quit();
}

TEST_F(ViewerStreaming, APackThatIsWrittenAnewTakesThePlaceOfTheOld) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35"));
  ASSERT_NO_FATAL_FAILURE(start());
  moveAway();
  ASSERT_NO_FATAL_FAILURE(pause());
  ASSERT_NO_FATAL_FAILURE(stepTo(8));
  Shot before, after, rendered;
  ASSERT_NO_FATAL_FAILURE(shoot(before));
  ASSERT_EQ(billow("compile '" + sampleFire() + "' --frames 12 --psnr 35 -o '" + (folder_ / "fire.blw") + "'").code, 0);
  ASSERT_TRUE(eventually([&] { return frame() == 12; })) << title();
  ASSERT_TRUE(eventually([&] { return difference(picture(), before).mean > 0.1; }));
  screen_.hand("key Home");  // the new one is larger
  ASSERT_NO_FATAL_FAILURE(shoot(after));
  ASSERT_NO_FATAL_FAILURE(render(scene_, "--frame 12", rendered));
  EXPECT_LE(difference(after, rendered).largest, 2);
  quit();
}

}  // namespace
}  // namespace billow::tests
