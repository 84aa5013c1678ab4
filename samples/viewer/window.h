// A window of the system, and what its user does with keys, pointer and files.
#ifndef BILLOW_VIEWER_WINDOW_H
#define BILLOW_VIEWER_WINDOW_H

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gpu.h"

struct GLFWwindow;

namespace billow::viewer {

// A part of the window, in its own units, from the upper left.
struct Area {
  float x = 0, y = 0, width = 0, height = 0;

  bool holds(double px, double py) const {
    return px >= double{x} && py >= double{y} && px < double{x} + double{width} && py < double{y} + double{height};
  }
};

// What has happened since it was taken last. Events are counted as they come, so that none is lost between two slow
// pictures.
struct Input {
  std::vector<int> keys;                          // GLFW_KEY_..., pressed or repeated, without Control
  double turnX = 0, turnY = 0;                    // pointer moved with the left button held, in window units
  double panX = 0, panY = 0;                      // with the middle one, or Shift and the left one
  double wheel = 0;                               // steps, above 0 away from the user
  std::optional<std::array<double, 2>> released;  // where the left button was let go last, window units
  std::vector<std::string> dropped;               // paths
  bool any = false;                               // anything at all, of which the panels may want to know
};

class Window {
 public:
  // Throws GpuFailure where there is no display, or no Vulkan on it.
  Window(const std::string& title, std::uint32_t width, std::uint32_t height);
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  ~Window();

  GLFWwindow* get() const { return window_; }
  headless::DeviceOptions deviceOptions() const;
  VkSurfaceKHR makeSurface(VkInstance instance) const;

  bool closing() const;
  void close();
  void setTitle(const std::string& title);
  // In pixels; 0 while minimised.
  VkExtent2D pixels() const;
  // How many pixels a unit of the window has.
  float scale() const;

  // Takes events in: those that are there, or waits for some for at most so long.
  void poll(double waitSeconds);
  Input takeInput();
  // Where pointer and wheel move the camera, unless a panel lies over it.
  void setPicture(const Area& area, bool covered);
  // Keys go to what is being typed into.
  void setTyping(bool typing) { typing_ = typing; }

 private:
  enum class Drag { none, turn, pan };

  void onKey(int key, int action, int mods);
  void onButton(int button, int action, int mods);
  void onMove(double x, double y);
  void onWheel(double y);
  bool overPicture() const;

  GLFWwindow* window_ = nullptr;
  std::string title_;
  Input input_;
  Area picture_;
  bool covered_ = false, typing_ = false;
  Drag drag_ = Drag::none;
  int dragButton_ = 0;
  double x_ = 0, y_ = 0;  // of the pointer
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_WINDOW_H
