// A loader of Vulkan's functions, as a host may lend it, that counts what is allocated and lets calls fail.
#ifndef BILLOW_TESTS_VULKAN_FAULTS_H
#define BILLOW_TESTS_VULKAN_FAULTS_H

#include <vulkan/vulkan_core.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <random>
#include <string_view>
#include <unordered_map>

#include "billow/runtime/runtime.h"

namespace billow::tests {

#define BILLOW_FAULTY(X)        \
  X(vkAllocateMemory)           \
  X(vkCreateBuffer)             \
  X(vkCreateImage)              \
  X(vkCreateImageView)          \
  X(vkDestroyBuffer)            \
  X(vkDestroyImage)             \
  X(vkDestroyImageView)         \
  X(vkFreeMemory)               \
  X(vkGetSemaphoreCounterValue) \
  X(vkMapMemory)                \
  X(vkQueueSubmit2)

// Vulkan's functions have no place for a user's pointer, so there is one of these, for one device at a time.
class VulkanFaults {
 public:
  static VulkanFaults& get() {
    static VulkanFaults faults;
    return faults;
  }

  // The host with functions that count and fail. Others may use the device beside it, uncounted.
  runtime::HostDevice wrap(runtime::HostDevice host) {
    const std::lock_guard lock(mutex_);
    loader_ = host.getInstanceProcAddr;
    deviceLoader_ = reinterpret_cast<PFN_vkGetDeviceProcAddr>(loader_(host.instance, "vkGetDeviceProcAddr"));
#define BILLOW_LOAD(name) name##_ = reinterpret_cast<PFN_##name>(deviceLoader_(host.device, #name));
    BILLOW_FAULTY(BILLOW_LOAD)
#undef BILLOW_LOAD
    host.getInstanceProcAddr = instanceFunction;
    return host;
  }

  struct Faults {
    double outOfMemory = 0;   // share of vkAllocateMemory calls that give VK_ERROR_OUT_OF_DEVICE_MEMORY
    bool deviceLost = false;  // submissions and semaphores give VK_ERROR_DEVICE_LOST; the device itself goes on
  };
  void setFaults(const Faults& faults) {
    const std::lock_guard lock(mutex_);
    faults_ = faults;
  }

  // Of what was made through the wrapped host. Memory counts as host memory from the moment that it is mapped.
  struct Stats {
    std::uint64_t deviceBytes = 0, devicePeak = 0, hostBytes = 0;
    std::uint64_t memories = 0, buffers = 0, images = 0, views = 0;  // alive
    std::uint64_t submissions = 0, outOfMemory = 0, lost = 0;        // the latter two: calls that failed
    bool none() const { return memories + buffers + images + views == 0; }
  };
  Stats stats() {
    const std::lock_guard lock(mutex_);
    settle();
    return stats_;
  }
  void resetPeak() {
    const std::lock_guard lock(mutex_);
    stats_.devicePeak = stats_.deviceBytes;
  }

 private:
  struct Memory {
    VkDeviceSize size;
    bool mapped;
  };

  VulkanFaults() = default;

  static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instanceFunction(VkInstance instance, const char* name) {
    if (std::string_view(name) == "vkGetDeviceProcAddr") return reinterpret_cast<PFN_vkVoidFunction>(deviceFunction);
    return get().loader_(instance, name);
  }
  static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL deviceFunction(VkDevice device, const char* name) {
#define BILLOW_MATCH(function) \
  if (std::string_view(name) == #function) return reinterpret_cast<PFN_vkVoidFunction>(function);
    BILLOW_FAULTY(BILLOW_MATCH)
#undef BILLOW_MATCH
    return get().deviceLoader_(device, name);
  }

  bool chance(double share) {
    return static_cast<double>(random_() >> 8) / 16777216.0 < share;
  }

  bool lost() {
    const std::lock_guard lock(mutex_);
    stats_.lost += faults_.deviceLost ? 1 : 0;
    return faults_.deviceLost;
  }
  bool outOfMemory() {
    const std::lock_guard lock(mutex_);
    settle();
    const bool fails = chance(faults_.outOfMemory);
    stats_.outOfMemory += fails ? 1 : 0;
    return fails;
  }
  // The peak lags by a call, so that memory which is mapped as soon as it is there does not count.
  void settle() {
    stats_.devicePeak = std::max(stats_.devicePeak, stats_.deviceBytes);
  }

  static VKAPI_ATTR VkResult VKAPI_CALL vkAllocateMemory(VkDevice device, const VkMemoryAllocateInfo* info,
                                                         const VkAllocationCallbacks* callbacks,
                                                         VkDeviceMemory* memory) {
    VulkanFaults& self = get();
    if (self.outOfMemory()) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    const VkResult result = self.vkAllocateMemory_(device, info, callbacks, memory);
    if (result != VK_SUCCESS) return result;
    const std::lock_guard lock(self.mutex_);
    self.memories_[*memory] = {info->allocationSize, false};
    ++self.stats_.memories;
    self.stats_.deviceBytes += info->allocationSize;
    return result;
  }

  static VKAPI_ATTR void VKAPI_CALL vkFreeMemory(VkDevice device, VkDeviceMemory memory,
                                                 const VkAllocationCallbacks* callbacks) {
    VulkanFaults& self = get();
    self.forget(memory);
    self.vkFreeMemory_(device, memory, callbacks);
  }

  void forget(VkDeviceMemory memory) {
    const std::lock_guard lock(mutex_);
    settle();
    const auto at = memories_.find(memory);
    if (at == memories_.end()) return;
    (at->second.mapped ? stats_.hostBytes : stats_.deviceBytes) -= at->second.size;
    --stats_.memories;
    memories_.erase(at);
  }

  static VKAPI_ATTR VkResult VKAPI_CALL vkMapMemory(VkDevice device, VkDeviceMemory memory, VkDeviceSize offset,
                                                    VkDeviceSize size, VkMemoryMapFlags flags, void** data) {
    VulkanFaults& self = get();
    {
      const std::lock_guard lock(self.mutex_);
      const auto at = self.memories_.find(memory);
      if (at != self.memories_.end() && !at->second.mapped) {
        at->second.mapped = true;
        self.stats_.deviceBytes -= at->second.size;
        self.stats_.hostBytes += at->second.size;
      }
    }
    return self.vkMapMemory_(device, memory, offset, size, flags, data);
  }

  static VKAPI_ATTR VkResult VKAPI_CALL vkQueueSubmit2(VkQueue queue, std::uint32_t count, const VkSubmitInfo2* infos,
                                                       VkFence fence) {
    VulkanFaults& self = get();
    if (self.lost()) return VK_ERROR_DEVICE_LOST;
    {
      const std::lock_guard lock(self.mutex_);
      ++self.stats_.submissions;
    }
    return self.vkQueueSubmit2_(queue, count, infos, fence);
  }

  static VKAPI_ATTR VkResult VKAPI_CALL vkGetSemaphoreCounterValue(VkDevice device, VkSemaphore semaphore,
                                                                   std::uint64_t* value) {
    VulkanFaults& self = get();
    if (self.lost()) return VK_ERROR_DEVICE_LOST;
    return self.vkGetSemaphoreCounterValue_(device, semaphore, value);
  }

#define BILLOW_COUNTED(Name, Handle, counter)                                                                    \
  static VKAPI_ATTR VkResult VKAPI_CALL vkCreate##Name(VkDevice device, const Vk##Name##CreateInfo* info,        \
                                                       const VkAllocationCallbacks* callbacks, Handle* handle) { \
    const VkResult result = get().vkCreate##Name##_(device, info, callbacks, handle);                            \
    if (result == VK_SUCCESS) get().count(&Stats::counter, 1);                                                   \
    return result;                                                                                               \
  }                                                                                                              \
  static VKAPI_ATTR void VKAPI_CALL vkDestroy##Name(VkDevice device, Handle handle,                              \
                                                    const VkAllocationCallbacks* callbacks) {                    \
    if (handle != VK_NULL_HANDLE) get().count(&Stats::counter, ~std::uint64_t{0});                               \
    get().vkDestroy##Name##_(device, handle, callbacks);                                                         \
  }
  BILLOW_COUNTED(Buffer, VkBuffer, buffers)
  BILLOW_COUNTED(Image, VkImage, images)
  BILLOW_COUNTED(ImageView, VkImageView, views)
#undef BILLOW_COUNTED

  void count(std::uint64_t Stats::*counter, std::uint64_t change) {
    const std::lock_guard lock(mutex_);
    stats_.*counter += change;
  }

  mutable std::mutex mutex_;
  std::mt19937 random_{1};
  Faults faults_;
  Stats stats_;
  std::unordered_map<VkDeviceMemory, Memory> memories_;
  PFN_vkGetInstanceProcAddr loader_ = nullptr;
  PFN_vkGetDeviceProcAddr deviceLoader_ = nullptr;
#define BILLOW_DECLARE(name) PFN_##name name##_ = nullptr;
  BILLOW_FAULTY(BILLOW_DECLARE)
#undef BILLOW_DECLARE
#undef BILLOW_FAULTY
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_VULKAN_FAULTS_H
