#include "upload.h"

#include <algorithm>
#include <utility>

#include "debug.h"

namespace billow::runtime {
namespace {

void copyAll(const Api& api, VkCommandBuffer commands, const FrameObjects& objects) {
  const OwnMemory& memory = *objects.memory;
  if (objects.bufferBytes != 0) {
    const VkBufferCopy whole{0, 0, objects.bufferBytes};
    api.vkCmdCopyBuffer(commands, objects.staging.handle(), memory.buffer.handle(), 1, &whole);
  }
  VkBufferImageCopy copy{};
  copy.bufferOffset = objects.atlasOffset;
  copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
  copy.imageExtent = memory.atlas.extent();
  api.vkCmdCopyBufferToImage(commands, objects.staging.handle(), memory.atlas.handle(),
                             VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &copy);
}

}  // namespace

Uploads::~Uploads() {
  const VkDevice device = device_.host.device;
  if (pool_ != VK_NULL_HANDLE) device_.api.vkDestroyCommandPool(device, pool_, device_.host.allocationCallbacks);
  if (semaphore_ != VK_NULL_HANDLE)
    device_.api.vkDestroySemaphore(device, semaphore_, device_.host.allocationCallbacks);
}

Result<void> Uploads::create() {
  auto poolInfo = begin<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  poolInfo.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT;
  poolInfo.queueFamilyIndex = device_.host.uploadFamily;
  VkResult result =
      device_.api.vkCreateCommandPool(device_.host.device, &poolInfo, device_.host.allocationCallbacks, &pool_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateCommandPool", result);
  auto type = begin<VkSemaphoreTypeCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO);
  type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
  auto info = begin<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
  info.pNext = &type;
  result = device_.api.vkCreateSemaphore(device_.host.device, &info, device_.host.allocationCallbacks, &semaphore_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateSemaphore", result);
  nameObject(device_, VK_OBJECT_TYPE_SEMAPHORE, semaphore_, "billow uploads at once");
  return {};
}

void Uploads::collect() {
  std::uint64_t done = 0;
  if (device_.api.vkGetSemaphoreCounterValue(device_.host.device, semaphore_, &done) != VK_SUCCESS) return;
  std::erase_if(pending_, [&](Pending& upload) {
    if (upload.value > done) return false;
    device_.api.vkFreeCommandBuffers(device_.host.device, pool_, 1, &upload.commands);
    return true;
  });
}

Result<void> Uploads::record(VkCommandBuffer commands, const FrameObjects& objects) const {
  auto beginInfo = begin<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  beginInfo.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  VkResult result = device_.api.vkBeginCommandBuffer(commands, &beginInfo);
  if (result != VK_SUCCESS) return vulkanError("vkBeginCommandBuffer", result);
  const VkImage atlas = objects.memory->atlas.handle();
  changeLayout(device_.api, commands, atlas, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
  copyAll(device_.api, commands, objects);
  changeLayout(device_.api, commands, atlas, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
               VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
  result = device_.api.vkEndCommandBuffer(commands);
  if (result != VK_SUCCESS) return vulkanError("vkEndCommandBuffer", result);
  return {};
}

Result<void> Uploads::queue(VkCommandBuffer commands) {
  auto commandInfo = begin<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
  commandInfo.commandBuffer = commands;
  auto signal = begin<VkSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO);
  signal.semaphore = semaphore_;
  signal.value = submitted_ + 1;
  signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
  auto submitInfo = begin<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
  submitInfo.commandBufferInfoCount = 1;
  submitInfo.pCommandBufferInfos = &commandInfo;
  submitInfo.signalSemaphoreInfoCount = 1;
  submitInfo.pSignalSemaphoreInfos = &signal;
  const VkResult result = device_.api.vkQueueSubmit2(device_.host.uploadQueue, 1, &submitInfo, VK_NULL_HANDLE);
  if (result != VK_SUCCESS) return vulkanError("vkQueueSubmit2", result);
  return {};
}

Result<void> Uploads::submit(FrameObjects& objects) {
  // Once the copies are queued nothing may fail: the device reads the staging memory.
  pending_.reserve(pending_.size() + 1);
  auto info = begin<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  info.commandPool = pool_;
  info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  info.commandBufferCount = 1;
  VkCommandBuffer commands = VK_NULL_HANDLE;
  const VkResult result = device_.api.vkAllocateCommandBuffers(device_.host.device, &info, &commands);
  if (result != VK_SUCCESS) return vulkanError("vkAllocateCommandBuffers", result);
  auto done = record(commands, objects);
  if (done) done = queue(commands);
  if (!done) {
    device_.api.vkFreeCommandBuffers(device_.host.device, pool_, 1, &commands);
    return done;
  }
  objects.frame->uploadValue_ = ++submitted_;
  pending_.push_back({submitted_, commands, std::move(objects.staging)});
  return {};
}

}  // namespace billow::runtime
