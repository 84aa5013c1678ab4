// The window's swapchain: a picture is laid into it, and panels are drawn over that.
#ifndef BILLOW_VIEWER_SCREEN_H
#define BILLOW_VIEWER_SCREEN_H

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "gpu.h"

struct ImDrawData;

namespace billow::viewer {

inline constexpr std::uint32_t kFramesInFlight = 2;

// What the submission waits for, besides the swapchain's image.
struct SemaphoreWait {
  VkSemaphore semaphore = VK_NULL_HANDLE;  // optional, a timeline
  std::uint64_t value = 0;
};

// An image to be laid into the window, in VK_IMAGE_LAYOUT_GENERAL and readable by transfers.
struct PictureSource {
  VkImage image = VK_NULL_HANDLE;  // optional
  VkExtent2D size{};
  VkRect2D place{};  // in pixels of the window
};

class Screen {
 public:
  // Takes the surface. A Dear ImGui context must exist; its Vulkan backend is started here and ended with the screen.
  Screen(const headless::VulkanDevice& device, VkSurfaceKHR surface);
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen();

  // Commands for a picture of this size, when the commands of kFramesInFlight pictures before have been executed;
  // VK_NULL_HANDLE where there is nothing to draw to now, as while the window changes.
  VkCommandBuffer begin(VkExtent2D pixels);
  // Which of the pictures in flight has begun.
  std::uint32_t slot() const { return slot_; }
  // Lays picture and panels into the window, submits and presents.
  void end(const PictureSource& picture, ImDrawData* panels, const SemaphoreWait& wait);

 private:
  struct Image {
    VkImage image = VK_NULL_HANDLE;
    ImageView view;
    Framebuffer framebuffer;
    Semaphore drawn;
  };
  struct Slot {
    CommandPool pool;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    Fence done;
    Semaphore acquired;
  };

  void chooseFormat();
  void makeRenderPass();
  void startPanels();
  void makeSlots();
  void rebuild(VkExtent2D pixels);
  void recordPicture(VkCommandBuffer commands, VkImage into, const PictureSource& picture) const;
  void submit(const SemaphoreWait& wait);

  const headless::VulkanDevice& device_;
  VkSurfaceKHR surface_;
  VkSurfaceFormatKHR format_{};
  RenderPass renderPass_;
  DescriptorPool descriptors_;
  Swapchain swapchain_;
  VkExtent2D extent_{};
  std::vector<Image> images_;
  std::array<Slot, kFramesInFlight> slots_;
  std::uint32_t slot_ = 0, image_ = 0;
  bool stale_ = true;  // the swapchain no longer fits the window
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_SCREEN_H
