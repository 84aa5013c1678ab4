// Instance, device, queue and the few objects that a picture needs; all freed with it.
#ifndef BILLOW_HEADLESS_DEVICE_H
#define BILLOW_HEADLESS_DEVICE_H

#include <string>
#include <vector>

#include "billow/headless/headless.h"
#include "functions.h"

namespace billow::headless {

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
  Result<void> createInstance(bool validation);
  Result<void> pickDevice(const DeviceOptions& options);
  Result<void> createDevice();

  void* library_ = nullptr;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
};

tl::unexpected<runtime::Error> gpuError(const std::string& message);

}  // namespace billow::headless

#endif  // BILLOW_HEADLESS_DEVICE_H
