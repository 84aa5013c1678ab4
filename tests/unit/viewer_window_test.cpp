// `billow view` on a virtual screen, with real keys and a real pointer: what is shown is looked at.
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "billow/format/pack.h"
#include "run_command.h"
#include "virtual_screen.h"

namespace billow::tests {
namespace {

// The window, and what its panels leave of it for the picture.
constexpr std::uint32_t kWidth = 480, kHeight = 360;
constexpr std::uint32_t kPictureWidth = 264, kPictureHeight = 282;

Shot readPng(const std::string& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  Shot shot;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) return shot;
  image.format = PNG_FORMAT_RGB;
  shot.width = image.width;
  shot.height = image.height;
  shot.rgb.resize(PNG_IMAGE_SIZE(image));
  png_image_finish_read(&image, nullptr, shot.rgb.data(), 0, nullptr);
  return shot;
}

// Pixels of glowing fire: bright, and much redder than blue.
std::size_t burning(const Shot& shot) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < shot.rgb.size(); i += 3) count += shot.rgb[i] > 120 && shot.rgb[i] > shot.rgb[i + 2] + 60;
  return count;
}

// The largest and the mean difference of two pictures, of 255.
struct Difference {
  int largest = 0;
  double mean = 0;
};
Difference difference(const Shot& a, const Shot& b) {
  Difference result;
  if (a.width != b.width || a.height != b.height || a.rgb.empty()) return {255, 255};
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const int apart = std::abs(int{a.rgb[i]} - int{b.rgb[i]});
    result.largest = std::max(result.largest, apart);
    result.mean += apart;
  }
  result.mean /= static_cast<double>(a.rgb.size());
  return result;
}

// Alters pages that only the first frame reads.
void breakFirstFrame(const std::string& path) {
  const auto pack = format::Pack::openFile(path);
  ASSERT_TRUE(pack.has_value());
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
  ASSERT_NE(section, pack->sections().end());
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  for (const std::uint32_t page : first) {
    if (others.contains(page)) continue;
    file.seekp(static_cast<std::streamoff>(section->offset + pack->pages()[page].offset));
    file.write("broken!!", 8);
  }
}

class ViewerWindow : public testing::Test {
 protected:
  // A scene of the sample fire with coarse voxels, so that a CPU draws it in little time.
  void SetUp() override {
    const CommandResult made = billow("compile '" + sampleFire() + "' --psnr 35 -o '" + (folder_ / "fire.blw") + "'");
    ASSERT_EQ(made.code, 0) << made.err;
    std::ofstream(scene_) << R"({"pack": "fire.blw", "voxelSize": 0.2})";
  }

  // Starts the viewer and waits for its first picture. The validation layer, where it is, writes to the log.
  void start(const std::string& path) {
    viewer_ = std::make_unique<Process>(screen_.environment() + "VK_INSTANCE_LAYERS=" + layers() +
                                        " \"$BILLOW\" view '" + path + "' --gpu-budget 160M --size " +
                                        std::to_string(kWidth) + "x" + std::to_string(kHeight) + " --screenshots '" +
                                        folder_.path().string() + "' >'" + log_ + "' 2>&1");
    ASSERT_TRUE(eventually([&] { return !viewer_->running() || title().find(" - frame ") != std::string::npos; }));
    ASSERT_TRUE(viewer_->running()) << readFile(log_);
    window_ = screen_.hand("search --name ' - frame '");
    screen_.hand("windowfocus " + window_);
  }
  static std::string layers() {
    const bool there = std::filesystem::exists("/usr/share/vulkan/explicit_layer.d/VkLayer_khronos_validation.json");
    return there ? "VK_LAYER_KHRONOS_validation" : "";
  }

  std::string title() const { return screen_.hand("search --name billow getwindowname"); }
  int frame() const {
    const std::string text = title();
    const std::size_t at = text.find(" - frame ");
    return at == std::string::npos ? -1 : std::atoi(text.c_str() + at + 9);
  }
  bool paused() const { return title().find("paused") != std::string::npos; }
  Shot picture() const { return screen_.look(kPictureWidth, kPictureHeight); }
  // The picture when no further one comes. The window's title tells only what is on the screen.
  Shot settled() const {
    Shot last;
    int same = 0;
    EXPECT_TRUE(eventually([&] {
      Shot now = picture();
      same = now == last ? same + 1 : 0;
      last = std::move(now);
      return same > 60;
    }));
    return last;
  }
  void pause() {
    screen_.hand("key space");
    ASSERT_TRUE(eventually([&] { return paused(); }));
  }
  void quit() {
    screen_.hand("key ctrl+q");
    ASSERT_TRUE(eventually([&] { return !viewer_->running(); }));
    EXPECT_EQ(viewer_->wait(), 0);
    EXPECT_EQ(readFile(log_), "");
  }

  TempFolder folder_;
  std::string scene_ = folder_ / "fire.scene.json", log_ = folder_ / "log";
  VirtualScreen screen_{640, 480};
  std::unique_ptr<Process> viewer_;
  std::string window_;
};

TEST_F(ViewerWindow, PlaysPausesStepsAndTakesPictures) {
  ASSERT_NO_FATAL_FAILURE(start(scene_));
  std::set<int> frames;
  std::set<std::vector<std::uint8_t>> pictures;
  ASSERT_TRUE(eventually([&] {
    frames.insert(frame());
    const Shot shot = picture();
    if (burning(shot) > 1000) pictures.insert(shot.rgb);
    return frames.size() >= 3 && pictures.size() >= 3;
  })) << frames.size()
      << " frames, " << pictures.size() << " pictures";

  ASSERT_NO_FATAL_FAILURE(pause());
  const Shot held = settled();
  const int number = frame();
  EXPECT_GT(burning(held), 1000u);
  EXPECT_EQ(settled(), held);
  EXPECT_EQ(frame(), number);

  screen_.hand("key Right");
  const int next = number == 12 ? 7 : number + 1;
  ASSERT_TRUE(eventually([&] { return frame() == next && picture() != held; })) << title();
  EXPECT_TRUE(paused());

  const Shot shown = settled();
  screen_.hand("key F12");
  char name[32];
  std::snprintf(name, sizeof(name), "fire.scene_%04d", next);
  const std::string file = folder_ / (std::string(name) + ".png");
  ASSERT_TRUE(eventually([&] { return readPng(file).rgb.size() == shown.rgb.size(); })) << file;
  // Message and pointer lie over what is shown; the rest is the file's, rounded alike.
  EXPECT_LT(difference(readPng(file), shown).mean, 0.02);
  const std::string rendered = folder_ / "rendered.png";
  ASSERT_EQ(billow("render '" + scene_ + "' --method metavoxel --frame " + std::to_string(next) + " --size " +
                   std::to_string(kPictureWidth) + "x" + std::to_string(kPictureHeight) + " -o '" + rendered + "'")
                .code,
            0);
  EXPECT_LE(difference(readPng(file), readPng(rendered)).largest, 2);
  screen_.hand("key F12");  // the first is not written over
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(folder_ / (std::string(name) + "_2.png")); }));
  quit();
}

TEST_F(ViewerWindow, OrbitsChangesItsLookAndItsSize) {
  ASSERT_NO_FATAL_FAILURE(start(scene_));
  ASSERT_NO_FATAL_FAILURE(pause());
  screen_.hand("mousemove 20 20");
  const Shot first = settled();
  ASSERT_GT(burning(first), 1000u);

  screen_.hand("mousemove 60 150 mousedown 1 mousemove 110 130 mousemove 160 110 mouseup 1 mousemove 20 20");
  ASSERT_TRUE(eventually([&] { return difference(picture(), first).mean > 1; }));
  const Shot turned = settled();
  EXPECT_GT(burning(turned), 1000u);
  screen_.hand("mousemove 100 100 click --repeat 4 4 mousemove 20 20");  // the wheel
  ASSERT_TRUE(eventually([&] { return burning(picture()) > burning(turned) * 5 / 4; }));
  screen_.hand("key Home");
  ASSERT_TRUE(eventually([&] { return picture() == first; }));

  // The slider of density, the first of all, to its lowest.
  screen_.hand("mousemove 276 37 click 1 mousemove 20 20");
  ASSERT_TRUE(eventually([&] { return difference(picture(), first).mean > 0.3; }));
  const Shot thin = settled();
  EXPECT_GT(burning(thin), 300u);

  // Without panels the picture has the whole window.
  screen_.hand("key Tab");
  ASSERT_TRUE(eventually([&] { return burning(screen_.look(kWidth, kHeight)) > 300 && picture() != thin; }));
  screen_.hand("key Tab");
  ASSERT_TRUE(eventually([&] { return picture() == thin; }));

  screen_.hand("windowsize " + window_ + " 600 440");
  const auto corner = [&] {
    const Shot shot = screen_.look(600, 440);
    return int{shot.at(595, 435)[0]} + shot.at(595, 435)[1] + shot.at(595, 435)[2];
  };
  ASSERT_TRUE(eventually([&] { return corner() > 30 && difference(picture(), thin).mean > 0.3; }));
  EXPECT_TRUE(viewer_->running());
  quit();
}

// A page that cannot be read is told of in the window; the rest plays on.
TEST_F(ViewerWindow, ABrokenPageIsNoEnd) {
  ASSERT_NO_FATAL_FAILURE(breakFirstFrame(folder_ / "fire.blw"));
  ASSERT_NO_FATAL_FAILURE(start(scene_));
  const auto red = [&] {
    const Shot shot = picture();
    const std::uint8_t* pixel = shot.at(14, 14);
    return pixel[0] > 60 && pixel[1] < 40 && pixel[2] < 40;
  };
  ASSERT_TRUE(eventually([&] { return red(); }));
  ASSERT_NO_FATAL_FAILURE(pause());
  EXPECT_TRUE(viewer_->running());
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
