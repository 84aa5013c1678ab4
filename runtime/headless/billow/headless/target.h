// A buffer or image with memory of its own, for one picture.
#ifndef BILLOW_HEADLESS_TARGET_H
#define BILLOW_HEADLESS_TARGET_H

#include "billow/headless/device.h"

namespace billow::headless {

// Host-visible memory with a buffer, or device memory with an image; lives as long as one call.
class Target {
 public:
  explicit Target(const VulkanDevice& device) : device_(device) {}
  Target(const Target&) = delete;
  Target& operator=(const Target&) = delete;
  ~Target();

  Result<void> makeBuffer(VkDeviceSize size, VkBufferUsageFlags usage);
  Result<void> makeImage(VkFormat format, std::uint32_t width, std::uint32_t height);
  VkDeviceAddress address() const;

  VkBuffer buffer = VK_NULL_HANDLE;
  VkImage image = VK_NULL_HANDLE;
  VkImageView view = VK_NULL_HANDLE;
  float* mapped = nullptr;

 private:
  Result<void> allocate(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags wanted);

  const VulkanDevice& device_;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
};

}  // namespace billow::headless

#endif  // BILLOW_HEADLESS_TARGET_H
