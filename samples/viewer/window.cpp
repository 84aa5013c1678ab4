#include "window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace billow::viewer {
namespace {

Window& windowOf(GLFWwindow* window) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

std::string lastError() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown cause";
}

}  // namespace

Window::Window(const std::string& title, std::uint32_t width, std::uint32_t height) : title_(title) {
  if (glfwInit() != GLFW_TRUE) throw GpuFailure("no display: " + lastError());
  if (glfwVulkanSupported() != GLFW_TRUE) {
    const std::string cause = lastError();
    glfwTerminate();
    throw GpuFailure("no Vulkan for windows: " + cause);
  }
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  window_ = glfwCreateWindow(static_cast<int>(width), static_cast<int>(height), title.c_str(), nullptr, nullptr);
  if (window_ == nullptr) {
    const std::string cause = lastError();
    glfwTerminate();
    throw GpuFailure("no window: " + cause);
  }
  glfwSetWindowUserPointer(window_, this);
  glfwSetKeyCallback(window_, [](GLFWwindow* window, int key, int, int action, int mods) {
    windowOf(window).onKey(key, action, mods);
  });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* window, int button, int action, int mods) {
    windowOf(window).onButton(button, action, mods);
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* window, double x, double y) { windowOf(window).onMove(x, y); });
  glfwSetScrollCallback(window_, [](GLFWwindow* window, double, double y) { windowOf(window).onWheel(y); });
  glfwSetDropCallback(window_, [](GLFWwindow* window, int count, const char** paths) {
    Input& input = windowOf(window).input_;
    input.dropped.insert(input.dropped.end(), paths, paths + count);
    input.any = true;
  });
  glfwSetWindowRefreshCallback(window_, [](GLFWwindow* window) { windowOf(window).input_.any = true; });
}

Window::~Window() {
  glfwDestroyWindow(window_);
  glfwTerminate();
}

headless::DeviceOptions Window::deviceOptions() const {
  headless::DeviceOptions options;
  std::uint32_t count = 0;
  const char** names = glfwGetRequiredInstanceExtensions(&count);
  if (names == nullptr) throw GpuFailure("no Vulkan for windows: " + lastError());
  options.instanceExtensions.assign(names, names + count);
  options.presents = [](VkInstance instance, VkPhysicalDevice device, std::uint32_t family) {
    return glfwGetPhysicalDevicePresentationSupport(instance, device, family) == GLFW_TRUE;
  };
  return options;
}

VkSurfaceKHR Window::makeSurface(VkInstance instance) const {
  VkSurfaceKHR surface = VK_NULL_HANDLE;
  check(glfwCreateWindowSurface(instance, window_, nullptr, &surface), "glfwCreateWindowSurface");
  return surface;
}

bool Window::closing() const {
  return glfwWindowShouldClose(window_) == GLFW_TRUE;
}

void Window::close() {
  glfwSetWindowShouldClose(window_, GLFW_TRUE);
}

void Window::setTitle(const std::string& title) {
  if (title == title_) return;
  title_ = title;
  glfwSetWindowTitle(window_, title.c_str());
}

VkExtent2D Window::pixels() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

float Window::scale() const {
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  return width > 0 ? static_cast<float>(pixels().width) / static_cast<float>(width) : 1;
}

void Window::poll(double waitSeconds) {
  if (waitSeconds > 0) {
    glfwWaitEventsTimeout(waitSeconds);
  } else {
    glfwPollEvents();
  }
}

Input Window::takeInput() {
  return std::exchange(input_, {});
}

void Window::setPicture(const Area& area, bool covered) {
  picture_ = area;
  covered_ = covered;
}

bool Window::overPicture() const {
  return !covered_ && picture_.holds(x_, y_);
}

void Window::onKey(int key, int action, int mods) {
  input_.any = true;
  if (action == GLFW_RELEASE || typing_) return;
  if ((mods & GLFW_MOD_CONTROL) == 0) {
    input_.keys.push_back(key);
  } else if (key == GLFW_KEY_Q || key == GLFW_KEY_W) {
    close();
  }
}

void Window::onButton(int button, int action, int mods) {
  input_.any = true;
  if (action == GLFW_RELEASE) {
    if (button == dragButton_) drag_ = Drag::none;
    if (button == GLFW_MOUSE_BUTTON_LEFT) input_.released = {x_, y_};
    return;
  }
  if (drag_ != Drag::none || !overPicture()) return;
  const bool left = button == GLFW_MOUSE_BUTTON_LEFT, middle = button == GLFW_MOUSE_BUTTON_MIDDLE;
  if (!left && !middle) return;
  drag_ = middle || (mods & GLFW_MOD_SHIFT) != 0 ? Drag::pan : Drag::turn;
  dragButton_ = button;
}

void Window::onMove(double x, double y) {
  input_.any = true;
  if (drag_ == Drag::turn) {
    input_.turnX += x - x_;
    input_.turnY += y - y_;
  } else if (drag_ == Drag::pan) {
    input_.panX += x - x_;
    input_.panY += y - y_;
  }
  x_ = x;
  y_ = y;
}

void Window::onWheel(double y) {
  input_.any = true;
  if (overPicture()) input_.wheel += y;
}

}  // namespace billow::viewer
