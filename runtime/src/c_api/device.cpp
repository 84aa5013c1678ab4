#include "c_api/device.h"

#include "c_api/structs.h"

namespace billow::c_api {
namespace {

// Finds each feature where a host may have enabled it: in the struct of its Vulkan version, or in one of its own.
void readFeatures(const VkPhysicalDeviceFeatures2& enabled, runtime::HostDevice& host) {
  host.features = {.bufferDeviceAddress = false, .timelineSemaphore = false, .synchronization2 = false};
  host.textureCompressionBc = enabled.features.textureCompressionBC == VK_TRUE;
  runtime::EnabledFeatures& features = host.features;
  const auto add = [](bool& feature, VkBool32 on) { feature = feature || on == VK_TRUE; };
  for (auto* next = static_cast<const VkBaseInStructure*>(enabled.pNext); next != nullptr; next = next->pNext) {
    const void* at = next;
    switch (next->sType) {
      case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES: {
        const auto* core = static_cast<const VkPhysicalDeviceVulkan12Features*>(at);
        add(features.bufferDeviceAddress, core->bufferDeviceAddress);
        add(features.timelineSemaphore, core->timelineSemaphore);
        break;
      }
      case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_3_FEATURES:
        add(features.synchronization2, static_cast<const VkPhysicalDeviceVulkan13Features*>(at)->synchronization2);
        break;
      case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_BUFFER_DEVICE_ADDRESS_FEATURES:
        add(features.bufferDeviceAddress,
            static_cast<const VkPhysicalDeviceBufferDeviceAddressFeatures*>(at)->bufferDeviceAddress);
        break;
      case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES:
        add(features.timelineSemaphore,
            static_cast<const VkPhysicalDeviceTimelineSemaphoreFeatures*>(at)->timelineSemaphore);
        break;
      case VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES:
        add(features.synchronization2,
            static_cast<const VkPhysicalDeviceSynchronization2Features*>(at)->synchronization2);
        break;
      default:
        break;
    }
  }
}

const char* missingHandle(const BillowDevice& device) {
  if (device.instance == VK_NULL_HANDLE) return "instance";
  if (device.physicalDevice == VK_NULL_HANDLE) return "physicalDevice";
  if (device.device == VK_NULL_HANDLE) return "device";
  if (device.getInstanceProcAddr == nullptr) return "getInstanceProcAddr";
  return device.uploadQueue == VK_NULL_HANDLE ? "uploadQueue" : nullptr;
}

}  // namespace

Outcome<runtime::HostDevice> hostOf(const BillowDevice* device) {
  return given(device).and_then([](const BillowDevice& d) -> Outcome<runtime::HostDevice> {
    if (const char* field = missingHandle(d)) return badArgument(std::string("BillowDevice::") + field + " is NULL");
    runtime::HostDevice host{.instance = d.instance,
                             .physicalDevice = d.physicalDevice,
                             .device = d.device,
                             .getInstanceProcAddr = d.getInstanceProcAddr,
                             .uploadQueue = d.uploadQueue,
                             .uploadFamily = d.uploadFamily,
                             .drawFamily = d.drawFamily,
                             .pipelineCache = d.pipelineCache,
                             .allocationCallbacks = d.allocationCallbacks};
    if (d.enabledFeatures != nullptr) readFeatures(*d.enabledFeatures, host);
    return host;
  });
}

}  // namespace billow::c_api
