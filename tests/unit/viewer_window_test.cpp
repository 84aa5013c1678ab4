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

// The window, and what its panels leave of it for the picture: small, since a CPU draws it.
constexpr std::uint32_t kWidth = 320, kHeight = 260;
constexpr std::uint32_t kPictureWidth = 176, kPictureHeight = 182;
constexpr std::uint32_t kBelow = 42;  // of a picture, where messages may lie over it

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

// Differences of two pictures, of 255: the largest, and the mean of all but their lowest part.
struct Difference {
  int largest = 0;
  double mean = 0;
};
Difference difference(const Shot& a, const Shot& b) {
  Difference result;
  if (a.width != b.width || a.height != b.height || a.height <= kBelow) return {255, 255};
  const std::size_t compared = std::size_t{a.width} * (a.height - kBelow) * 3;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) {
    const int apart = std::abs(int{a.rgb[i]} - int{b.rgb[i]});
    result.largest = std::max(result.largest, apart);
    if (i < compared) result.mean += apart;
  }
  result.mean /= static_cast<double>(compared);
  return result;
}

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

class ViewerWindow : public testing::Test {
 protected:
  // A scene of the sample fire with coarse voxels, so that a CPU draws it in little time.
  void compile(const std::string& psnr) {
    const CommandResult made =
        billow("compile '" + sampleFire() + "' --psnr " + psnr + " -o '" + (folder_ / "fire.blw") + "'");
    ASSERT_EQ(made.code, 0) << made.err;
    std::ofstream(scene_) << R"({"pack": "fire.blw", "voxelSize": 0.4, "look": {"scatteringOrders": 1}})";
  }

  // Starts the viewer and waits for its first picture. The validation layer, where it is, writes to the log.
  void start() {
    viewer_ = std::make_unique<Process>(screen_.environment() + "VK_INSTANCE_LAYERS=" + layers() +
                                        " \"$BILLOW\" view '" + scene_ + "' --gpu-budget 160M --size " +
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
  int brightness(std::uint32_t x, std::uint32_t y) const {
    const Shot shot = screen_.look(x + 1, y + 1);
    return int{shot.at(x, y)[0]} + shot.at(x, y)[1] + shot.at(x, y)[2];
  }
  // The pointer out of the window.
  void moveAway() const { screen_.hand("mousemove 470 350"); }

  // Has a picture written, and gives it when it also is on the screen. `file`: where it is.
  void shoot(Shot& shot, std::string* file = nullptr) {
    screen_.hand("key F12");
    std::string path;
    ASSERT_TRUE(eventually([&] {
      for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
        if (entry.path().extension() == ".png" && !pictures_.contains(entry.path().string())) path = entry.path();
      }
      return !path.empty();
    })) << "no picture";
    pictures_.insert(path);
    ASSERT_TRUE(eventually([&] { return !(shot = readPng(path)).rgb.empty(); })) << path;
    ASSERT_TRUE(eventually([&] { return difference(screen_.look(shot.width, shot.height), shot).mean < 0.02; }))
        << path << " is not what is shown";
    if (file != nullptr) *file = path;
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
  VirtualScreen screen_{480, 360};
  std::unique_ptr<Process> viewer_;
  std::string window_;
  std::set<std::string> pictures_;  // that were written
};

TEST_F(ViewerWindow, PlaysPausesStepsAndTakesPictures) {
  ASSERT_NO_FATAL_FAILURE(compile("35"));
  ASSERT_NO_FATAL_FAILURE(start());
  moveAway();
  std::set<int> frames;
  std::set<std::string> pictures;
  ASSERT_TRUE(eventually([&] {
    frames.insert(frame());
    const Shot shot = picture();
    if (burning(shot) > 400) pictures.emplace(shot.rgb.begin(), shot.rgb.end());
    return frames.size() >= 3 && pictures.size() >= 3;
  })) << frames.size()
      << " frames, " << pictures.size() << " pictures";

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
  const std::string rendered = folder_ / "rendered.png";
  pictures_.insert(rendered);
  ASSERT_EQ(billow("render '" + scene_ + "' --method metavoxel --frame " + std::to_string(next) + " --size " +
                   std::to_string(kPictureWidth) + "x" + std::to_string(kPictureHeight) + " -o '" + rendered + "'")
                .code,
            0);
  EXPECT_LE(difference(stepped, readPng(rendered)).largest, 2);

  screen_.hand("key space");
  ASSERT_TRUE(eventually([&] { return !paused() && difference(picture(), stepped).mean > 0.1; }));
  quit();
}

TEST_F(ViewerWindow, OrbitsChangesItsLookAndItsSize) {
  ASSERT_NO_FATAL_FAILURE(compile("35"));
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
  ASSERT_NO_FATAL_FAILURE(compile("50"));  // a frame fills pages of its own
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
