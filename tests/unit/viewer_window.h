// `billow view` on a virtual screen, with real keys and a real pointer: what is shown is looked at.
#ifndef BILLOW_TESTS_VIEWER_WINDOW_H
#define BILLOW_TESTS_VIEWER_WINDOW_H

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "run_command.h"
#include "virtual_screen.h"

namespace billow::tests {

// The window, and what its panels leave of it for the picture: small, since a CPU draws it.
inline constexpr std::uint32_t kWidth = 320, kHeight = 260;
inline constexpr std::uint32_t kPictureWidth = 176, kPictureHeight = 182;
inline constexpr std::uint32_t kBelow = 42;  // of a picture, where messages may lie over it

inline Shot readPng(const std::string& path) {
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
inline std::size_t burning(const Shot& shot) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < shot.rgb.size(); i += 3) count += shot.rgb[i] > 120 && shot.rgb[i] > shot.rgb[i + 2] + 60;
  return count;
}

// Differences of two pictures, of 255: the largest, and the mean of all but their lowest part.
struct Difference {
  int largest = 0;
  double mean = 0;
};
inline Difference difference(const Shot& a, const Shot& b) {
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

class ViewerWindow : public testing::Test {
 protected:
  // A scene of the sample fire with coarse voxels, so that a CPU draws it in little time.
  void compile(const std::string& options, const std::string& sceneMembers = "") {
    const CommandResult made =
        billow("compile '" + sampleFire() + "' " + options + " -o '" + (folder_ / "fire.blw") + "'");
    ASSERT_EQ(made.code, 0) << made.err;
    std::ofstream(scene_) << R"({"pack": "fire.blw", "voxelSize": 0.4, "look": {"scatteringOrders": 1})" << sceneMembers
                          << "}";
  }

  // Starts the viewer and waits for its first picture. The validation layer, where it is, writes to the log.
  void start(const std::string& options = "") {
    viewer_ = std::make_unique<Process>(screen_.environment() + "VK_INSTANCE_LAYERS=" + layers() +
                                        " \"$BILLOW\" view '" + scene_ + "' --gpu-budget 160M --size " +
                                        std::to_string(kWidth) + "x" + std::to_string(kHeight) + " --screenshots '" +
                                        folder_.path().string() + "' " + options + " >'" + log_ + "' 2>&1");
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
  // What `billow render` makes of the scene, in the size that the viewer's picture has.
  void render(const std::string& scene, const std::string& options, Shot& shot) {
    const std::string file = folder_ / "rendered.png";
    pictures_.insert(file);
    const CommandResult done =
        billow("render '" + scene + "' --method metavoxel " + options + " --size " + std::to_string(kPictureWidth) +
               "x" + std::to_string(kPictureHeight) + " -o '" + file + "'");
    ASSERT_EQ(done.code, 0) << done.err;
    shot = readPng(file);
  }
  // Until it has played through that many frames, and shown as many pictures with more than `least` burning pixels.
  // check(shot) looks at each.
  template <class Check>
  void watchPlay(std::size_t count, std::uint32_t least, const Check& check) const {
    std::set<int> frames;
    std::set<std::string> pictures;
    ASSERT_TRUE(eventually([&] {
      frames.insert(frame());
      const Shot shot = picture();
      check(shot);
      if (burning(shot) > least) pictures.emplace(shot.rgb.begin(), shot.rgb.end());
      return frames.size() >= count && pictures.size() >= count;
    })) << frames.size()
        << " frames, " << pictures.size() << " pictures";
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

}  // namespace billow::tests

#endif  // BILLOW_TESTS_VIEWER_WINDOW_H
