// Instance, device and queue of our own hosts, with a window or without; freed with it.
#ifndef BILLOW_HEADLESS_DEVICE_H
#define BILLOW_HEADLESS_DEVICE_H

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "billow/headless/functions.h"
#include "billow/runtime/runtime.h"

namespace billow::headless {

using runtime::Result;

struct DeviceOptions {
  std::optional<std::uint32_t> device = {};  // as Vulkan numbers them; default: a discrete GPU if there is one
  bool validation = false;                   // VK_LAYER_KHRONOS_validation; fails where it is not installed
  // For a window: what its system asks of the instance, and whether a queue family presents to it. With `presents` the
  // queue draws and presents too, and swapchains are enabled.
  std::vector<const char*> instanceExtensions = {};
  std::function<bool(VkInstance, VkPhysicalDevice, std::uint32_t family)> presents = {};
};

class VulkanDevice {
 public:
  VulkanDevice() = default;
  VulkanDevice(const VulkanDevice&) = delete;
  VulkanDevice& operator=(const VulkanDevice&) = delete;
  ~VulkanDevice();

  Result<void> open(const DeviceOptions& options);

  Functions vk;
  runtime::HostDevice host;
  std::string name;
  float timestampPeriod = 1;  // nanoseconds a tick
  std::vector<std::string> messages;

 private:
  Result<void> loadLibrary();
  Result<void> createInstance(const DeviceOptions& options);
  Result<void> pickDevice(const DeviceOptions& options);
  Result<void> createDevice(bool swapchains);
  // The family of the queue to take, where the device has one.
  std::optional<std::uint32_t> familyOf(VkPhysicalDevice device, const DeviceOptions& options) const;

  void* library_ = nullptr;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
};

tl::unexpected<runtime::Error> gpuError(const std::string& message);

}  // namespace billow::headless

#endif  // BILLOW_HEADLESS_DEVICE_H
