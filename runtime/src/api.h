// Vulkan through the host's loader: no symbol of it is linked.
#ifndef BILLOW_RUNTIME_API_H
#define BILLOW_RUNTIME_API_H

#include <vulkan/vulkan_core.h>

#include <atomic>
#include <string>

#include "billow/runtime/runtime.h"

namespace billow::runtime {

#define BILLOW_INSTANCE_FUNCTIONS(X)          \
  X(vkGetDeviceProcAddr)                      \
  X(vkGetPhysicalDeviceProperties2)           \
  X(vkGetPhysicalDeviceMemoryProperties)      \
  X(vkGetPhysicalDeviceFormatProperties)      \
  X(vkGetPhysicalDeviceImageFormatProperties) \
  X(vkGetPhysicalDeviceQueueFamilyProperties)

#define BILLOW_DEVICE_FUNCTIONS(X) \
  X(vkAllocateCommandBuffers)      \
  X(vkAllocateDescriptorSets)      \
  X(vkAllocateMemory)              \
  X(vkBeginCommandBuffer)          \
  X(vkBindBufferMemory)            \
  X(vkBindImageMemory)             \
  X(vkCmdBindDescriptorSets)       \
  X(vkCmdBindPipeline)             \
  X(vkCmdClearColorImage)          \
  X(vkCmdCopyBuffer)               \
  X(vkCmdCopyBufferToImage)        \
  X(vkCmdDispatch)                 \
  X(vkCmdDispatchIndirect)         \
  X(vkCmdFillBuffer)               \
  X(vkCmdPipelineBarrier2)         \
  X(vkCmdPushConstants)            \
  X(vkCmdWriteTimestamp2)          \
  X(vkCreateBuffer)                \
  X(vkCreateCommandPool)           \
  X(vkCreateComputePipelines)      \
  X(vkCreateDescriptorPool)        \
  X(vkCreateDescriptorSetLayout)   \
  X(vkCreateImage)                 \
  X(vkCreateImageView)             \
  X(vkCreatePipelineLayout)        \
  X(vkCreateSampler)               \
  X(vkCreateSemaphore)             \
  X(vkCreateShaderModule)          \
  X(vkDestroyBuffer)               \
  X(vkDestroyCommandPool)          \
  X(vkDestroyDescriptorPool)       \
  X(vkDestroyDescriptorSetLayout)  \
  X(vkDestroyImage)                \
  X(vkDestroyImageView)            \
  X(vkDestroyPipeline)             \
  X(vkDestroyPipelineLayout)       \
  X(vkDestroySampler)              \
  X(vkDestroySemaphore)            \
  X(vkDestroyShaderModule)         \
  X(vkEndCommandBuffer)            \
  X(vkFreeCommandBuffers)          \
  X(vkFreeMemory)                  \
  X(vkGetBufferDeviceAddress)      \
  X(vkGetBufferMemoryRequirements) \
  X(vkGetImageMemoryRequirements)  \
  X(vkGetSemaphoreCounterValue)    \
  X(vkMapMemory)                   \
  X(vkQueueSubmit2)                \
  X(vkUpdateDescriptorSets)        \
  X(vkWaitSemaphores)

// Null where the host's instance does not have VK_EXT_debug_utils enabled.
#define BILLOW_DEBUG_FUNCTIONS(X) \
  X(vkCmdBeginDebugUtilsLabelEXT) \
  X(vkCmdEndDebugUtilsLabelEXT)   \
  X(vkSetDebugUtilsObjectNameEXT)

struct Api {
#define BILLOW_DECLARE(name) PFN_##name name = nullptr;
  BILLOW_INSTANCE_FUNCTIONS(BILLOW_DECLARE)
  BILLOW_DEVICE_FUNCTIONS(BILLOW_DECLARE)
  BILLOW_DEBUG_FUNCTIONS(BILLOW_DECLARE)
#undef BILLOW_DECLARE
};

// Fails with the first function that is missing.
Result<Api> loadApi(const HostDevice& host);

// A Vulkan structure with its type set and all else zero.
template <class Info>
Info begin(VkStructureType type) {
  Info info{};
  info.sType = type;
  return info;
}

// What every object of the runtime needs. Streaming allocates on other threads than those that record.
struct Device {
  HostDevice host;
  Api api;
  VkPhysicalDeviceMemoryProperties memory{};
  std::uint32_t maxImageExtent3D = 0;
  std::uint64_t imageGranularity = 1;     // bytes between a buffer and an image in one memory
  std::uint64_t mostAllocation = 0;       // bytes of one, and of one buffer
  VkExtent3D uploadGranularity{1, 1, 1};  // of image copies on the upload queue
  std::uint64_t budget = 0;
  std::atomic<std::uint64_t> used = 0;
  std::atomic<std::uint64_t> frames = 0;  // that were made: each has a number of its own
  bool bc7 = false;  // BC7 bricks stay BC7, in a sampled 3D image; else they are decoded to uniform bricks of 8 bits
  std::uint32_t leastAtlasBricks = 0;  // as LoadRequest has it
};

// The renderer's, for parts that share it.
Device& deviceOf(Renderer& renderer);

// Counts bytes as used, or returns false where they would exceed the budget.
bool takeBytes(Device& device, std::uint64_t bytes);

tl::unexpected<Error> vulkanError(const char* call, VkResult result);
inline bool isVulkan(ErrorCode code) {
  return code == ErrorCode::vulkan || code == ErrorCode::deviceLost;
}
tl::unexpected<Error> failure(ErrorCode code, std::string message);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_API_H
