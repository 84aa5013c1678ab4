// Vulkan as the viewer uses it: objects that free themselves, and failures that end what was being done.
#ifndef BILLOW_VIEWER_GPU_H
#define BILLOW_VIEWER_GPU_H

#include <vulkan/vulkan.h>

#include <stdexcept>
#include <string>
#include <utility>

#include "billow/headless/device.h"

namespace billow::viewer {

// The device or the window's system fails; the message is one line.
class GpuFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline void check(VkResult result, const char* call) {
  if (result != VK_SUCCESS) throw GpuFailure(std::string(call) + " gives VkResult " + std::to_string(result));
}

template <class T>
T valueOf(runtime::Result<T> result) {
  if (!result) throw GpuFailure(result.error().message);
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

// A handle and the device function that destroys it.
template <class Handle, auto destroy>
class Owned {
 public:
  Owned() = default;
  Owned(VkDevice device, Handle handle) : device_(device), handle_(handle) {}
  Owned(Owned&& other) noexcept : device_(other.device_), handle_(std::exchange(other.handle_, VK_NULL_HANDLE)) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Owned() {
    if (handle_ != VK_NULL_HANDLE) destroy(device_, handle_, nullptr);
  }
  Handle get() const { return handle_; }

 private:
  VkDevice device_ = VK_NULL_HANDLE;
  Handle handle_ = VK_NULL_HANDLE;
};

// make(VkDevice, const Info*, const VkAllocationCallbacks*, Handle*), called `name`.
template <class Wrapped, class Make, class Info>
Wrapped makeOwned(VkDevice device, const Make& make, const char* name, const Info& info) {
  decltype(std::declval<Wrapped>().get()) handle = VK_NULL_HANDLE;
  check(make(device, &info, nullptr, &handle), name);
  return Wrapped(device, handle);
}

using CommandPool = Owned<VkCommandPool, vkDestroyCommandPool>;
using DescriptorPool = Owned<VkDescriptorPool, vkDestroyDescriptorPool>;
using DescriptorSetLayout = Owned<VkDescriptorSetLayout, vkDestroyDescriptorSetLayout>;
using Fence = Owned<VkFence, vkDestroyFence>;
using Framebuffer = Owned<VkFramebuffer, vkDestroyFramebuffer>;
using ImageView = Owned<VkImageView, vkDestroyImageView>;
using Pipeline = Owned<VkPipeline, vkDestroyPipeline>;
using PipelineLayout = Owned<VkPipelineLayout, vkDestroyPipelineLayout>;
using QueryPool = Owned<VkQueryPool, vkDestroyQueryPool>;
using RenderPass = Owned<VkRenderPass, vkDestroyRenderPass>;
using Semaphore = Owned<VkSemaphore, vkDestroySemaphore>;
using ShaderModule = Owned<VkShaderModule, vkDestroyShaderModule>;
using Swapchain = Owned<VkSwapchainKHR, vkDestroySwapchainKHR>;

// What an image was and will be used for; its contents are lost where `from` is undefined.
struct ImageUse {
  VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
  VkPipelineStageFlags2 stage = VK_PIPELINE_STAGE_2_NONE;
  VkAccessFlags2 access = VK_ACCESS_2_NONE;
};

inline void recordBarrier(VkCommandBuffer commands, VkImage image, const ImageUse& from, const ImageUse& to) {
  auto barrier = headless::begin<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
  barrier.srcStageMask = from.stage;
  barrier.srcAccessMask = from.access;
  barrier.dstStageMask = to.stage;
  barrier.dstAccessMask = to.access;
  barrier.oldLayout = from.layout;
  barrier.newLayout = to.layout;
  barrier.srcQueueFamilyIndex = barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  auto info = headless::begin<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.imageMemoryBarrierCount = 1;
  info.pImageMemoryBarriers = &barrier;
  vkCmdPipelineBarrier2(commands, &info);
}

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_GPU_H
