// `billow view`: playing, stepping, pictures, camera, look, size, and what goes wrong.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "billow/format/pack.h"
#include "viewer_window.h"

namespace billow::tests {
namespace {

// Alters the pages that only the first frame reads, and says how many.
std::size_t breakFirstFrame(const std::string& path) {
  const auto pack = format::Pack::openFile(path);
  if (!pack) return 0;
  const format::VolumeRecord& volume = pack->volumes()[0];
  std::set<std::uint32_t> first, others;
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    for (std::uint32_t grid = 0; grid < volume.gridCount; ++grid) {
      const auto pages = pack->pagesOf(pack->gridFrame(volume, frame, grid));
      (frame == 0 ? first : others).insert(pages.begin(), pages.end());
    }
  }
  const auto section =
      std::find_if(pack->sections().begin(), pack->sections().end(),
                   [](const format::SectionEntry& entry) { return entry.type == format::kSectionPages; });
  if (section == pack->sections().end()) return 0;
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  std::size_t altered = 0;
  for (const std::uint32_t page : first) {
    if (others.contains(page)) continue;
    file.seekp(static_cast<std::streamoff>(section->offset + pack->pages()[page].offset));
    file.write("broken!!", 8);
    ++altered;
  }
  return file ? altered : 0;
}

TEST_F(ViewerWindow, PlaysPausesStepsAndTakesPictures) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35"));
  ASSERT_NO_FATAL_FAILURE(start());
  moveAway();
  ASSERT_NO_FATAL_FAILURE(watchPlay(3, 400, [](const Shot&) {}));

  ASSERT_NO_FATAL_FAILURE(pause());
  const int number = frame();
  Shot held, later, stepped;
  ASSERT_NO_FATAL_FAILURE(shoot(held));
  EXPECT_GT(burning(held), 400u);
  ASSERT_NO_FATAL_FAILURE(shoot(later));          // the first is not written over
  EXPECT_LE(difference(later, held).largest, 1);  // blocks lie where they happen to
  EXPECT_EQ(frame(), number);

  screen_.hand("key Right");
  const int next = number == 12 ? 7 : number + 1;
  ASSERT_TRUE(eventually([&] { return frame() == next; })) << title();
  EXPECT_TRUE(paused());
  std::string file;
  ASSERT_NO_FATAL_FAILURE(shoot(stepped, &file));
  EXPECT_GT(difference(stepped, held).mean, 0.1);
  char name[32];
  std::snprintf(name, sizeof(name), "fire.scene_%04d", next);
  EXPECT_EQ(std::filesystem::path(file).stem(), name);
  Shot rendered;
  ASSERT_NO_FATAL_FAILURE(render(scene_, "--frame " + std::to_string(next), rendered));
  EXPECT_LE(difference(stepped, rendered).largest, 2);

  screen_.hand("key space");
  ASSERT_TRUE(eventually([&] { return !paused() && difference(picture(), stepped).mean > 0.1; }));
  quit();
}

TEST_F(ViewerWindow, OrbitsChangesItsLookAndItsSize) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 35"));
  ASSERT_NO_FATAL_FAILURE(start());
  moveAway();
  ASSERT_NO_FATAL_FAILURE(pause());
  Shot first;
  ASSERT_NO_FATAL_FAILURE(shoot(first));
  ASSERT_GT(burning(first), 400u);

  screen_.hand("mousemove 40 120 mousedown 1 mousemove 80 100 mousemove 120 80 mouseup 1");
  moveAway();
  ASSERT_TRUE(eventually([&] { return difference(picture(), first).mean > 1; }));
  Shot turned;
  ASSERT_NO_FATAL_FAILURE(shoot(turned));
  EXPECT_GT(burning(turned), 400u);
  screen_.hand("mousemove 80 80 click --repeat 4 4");  // the wheel
  moveAway();
  ASSERT_TRUE(eventually([&] { return burning(picture()) > burning(turned) * 5 / 4; }));
  screen_.hand("key Home");
  ASSERT_TRUE(eventually([&] { return difference(picture(), first).mean < 0.02; }));

  // The slider of density, the first of all, to its lowest.
  screen_.hand("mousemove 187 37 click 1");
  moveAway();
  ASSERT_TRUE(eventually([&] { return difference(picture(), first).mean > 0.3; }));
  Shot thin, whole, wide;
  ASSERT_NO_FATAL_FAILURE(shoot(thin));
  EXPECT_GT(burning(thin), 100u);
  EXPECT_GT(difference(thin, first).mean, 0.3);

  // Without panels the picture has the whole window.
  screen_.hand("key Tab");
  ASSERT_NO_FATAL_FAILURE(shoot(whole));
  EXPECT_EQ(whole.width, kWidth);
  EXPECT_EQ(whole.height, kHeight);
  EXPECT_GT(burning(whole), burning(thin));
  screen_.hand("key Tab");
  ASSERT_TRUE(eventually([&] { return difference(picture(), thin).mean < 0.02; }));

  screen_.hand("windowsize " + window_ + " 400 330");
  ASSERT_TRUE(eventually([&] { return brightness(395, 325) > 30; }));
  ASSERT_NO_FATAL_FAILURE(shoot(wide));
  EXPECT_EQ(wide.width, 220u);
  EXPECT_EQ(wide.height, 252u);
  EXPECT_GT(burning(wide), burning(thin));
  quit();
}

// A page that cannot be read is told of in the window; the rest plays on.
TEST_F(ViewerWindow, ABrokenPageIsNoEnd) {
  ASSERT_NO_FATAL_FAILURE(compile("--psnr 50"));  // a frame fills pages of its own
  ASSERT_GT(breakFirstFrame(folder_ / "fire.blw"), 0u);
  ASSERT_NO_FATAL_FAILURE(start());
  screen_.hand("key Tab");  // the message leaves room for the picture
  std::set<std::string> pictures;
  ASSERT_TRUE(eventually([&] {
    const Shot shot = screen_.look(kWidth, kHeight);
    const std::uint8_t* pixel = shot.at(14, 14);
    const bool told = pixel[0] > 60 && pixel[1] < 40 && pixel[2] < 40;
    if (told && burning(shot) > 400) pictures.emplace(shot.rgb.begin(), shot.rgb.end());
    return pictures.size() >= 3;
  }));
  quit();
}

TEST(ViewerCommand, WithoutADisplayThereIsAClearError) {
  const TempFolder folder;
  const std::string pack = folder / "fire.blw";
  ASSERT_EQ(billow("compile '" + sampleFire() + "' --frames 7 --psnr 30 -o '" + pack + "'").code, 0);
  const CommandResult result = billow("view '" + pack + "'", "unset DISPLAY WAYLAND_DISPLAY; ");
  EXPECT_EQ(result.code, 4);
  EXPECT_NE(result.err.find("no display"), std::string::npos) << result.err;
  EXPECT_EQ(result.out, "");
}

TEST(ViewerCommand, WhatCannotBeOpenedIsRefusedBeforeAnyWindow) {
  const TempFolder folder;
  EXPECT_EQ(billow("view '" + (folder / "none.blw") + "'").code, 2);
  std::ofstream(folder / "bad.blw") << "not a pack";
  EXPECT_EQ(billow("view '" + (folder / "bad.blw") + "'").code, 3);
  EXPECT_EQ(billow("view '" + (folder / "bad.blw") + "' --size 0x7").code, 1);
  EXPECT_EQ(billow("view '" + (folder / "bad.blw") + "' --volume a --effect b").code, 1);
  EXPECT_EQ(billow("view '" + (folder / "bad.blw") + "' --screenshots '" + (folder / "none") + "'").code, 1);
}

}  // namespace
}  // namespace billow::tests
