// Vulkan functions of the headless host, through the loader that it opened itself.
#ifndef BILLOW_HEADLESS_FUNCTIONS_H
#define BILLOW_HEADLESS_FUNCTIONS_H

#include <vulkan/vulkan_core.h>

#define BILLOW_HEADLESS_GLOBAL(X) \
  X(vkCreateInstance)             \
  X(vkEnumerateInstanceLayerProperties)

#define BILLOW_HEADLESS_INSTANCE(X)      \
  X(vkCreateDevice)                      \
  X(vkDestroyInstance)                   \
  X(vkEnumeratePhysicalDevices)          \
  X(vkGetDeviceProcAddr)                 \
  X(vkGetPhysicalDeviceFeatures2)        \
  X(vkGetPhysicalDeviceMemoryProperties) \
  X(vkGetPhysicalDeviceProperties)       \
  X(vkGetPhysicalDeviceQueueFamilyProperties)

#define BILLOW_HEADLESS_DEVICE(X)  \
  X(vkAllocateCommandBuffers)      \
  X(vkAllocateMemory)              \
  X(vkBeginCommandBuffer)          \
  X(vkBindBufferMemory)            \
  X(vkBindImageMemory)             \
  X(vkCmdCopyBuffer)               \
  X(vkCmdCopyBufferToImage)        \
  X(vkCmdCopyImageToBuffer)        \
  X(vkCmdPipelineBarrier2)         \
  X(vkCmdResetQueryPool)           \
  X(vkCmdWriteTimestamp2)          \
  X(vkCreateBuffer)                \
  X(vkCreateCommandPool)           \
  X(vkCreateImage)                 \
  X(vkCreateImageView)             \
  X(vkCreateQueryPool)             \
  X(vkDestroyBuffer)               \
  X(vkDestroyCommandPool)          \
  X(vkDestroyDevice)               \
  X(vkDestroyImage)                \
  X(vkDestroyImageView)            \
  X(vkDestroyQueryPool)            \
  X(vkDeviceWaitIdle)              \
  X(vkEndCommandBuffer)            \
  X(vkFreeMemory)                  \
  X(vkGetBufferDeviceAddress)      \
  X(vkGetBufferMemoryRequirements) \
  X(vkGetDeviceQueue)              \
  X(vkGetImageMemoryRequirements)  \
  X(vkGetQueryPoolResults)         \
  X(vkMapMemory)                   \
  X(vkQueueSubmit2)                \
  X(vkQueueWaitIdle)               \
  X(vkResetCommandPool)

namespace billow::headless {

struct Functions {
  PFN_vkGetInstanceProcAddr vkGetInstanceProcAddr = nullptr;
#define BILLOW_DECLARE(name) PFN_##name name = nullptr;
  BILLOW_HEADLESS_GLOBAL(BILLOW_DECLARE)
  BILLOW_HEADLESS_INSTANCE(BILLOW_DECLARE)
  BILLOW_HEADLESS_DEVICE(BILLOW_DECLARE)
#undef BILLOW_DECLARE
};

template <class Info>
Info begin(VkStructureType type) {
  Info info{};
  info.sType = type;
  return info;
}

}  // namespace billow::headless

#endif  // BILLOW_HEADLESS_FUNCTIONS_H
