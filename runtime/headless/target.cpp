#include "billow/headless/target.h"

namespace billow::headless {

Target::~Target() {
  const VkDevice device = device_.host.device;
  if (view != VK_NULL_HANDLE) device_.vk.vkDestroyImageView(device, view, nullptr);
  if (image != VK_NULL_HANDLE) device_.vk.vkDestroyImage(device, image, nullptr);
  if (buffer != VK_NULL_HANDLE) device_.vk.vkDestroyBuffer(device, buffer, nullptr);
  if (memory_ != VK_NULL_HANDLE) device_.vk.vkFreeMemory(device, memory_, nullptr);
}

Result<void> Target::makeBuffer(VkDeviceSize size, VkBufferUsageFlags usage) {
  auto info = begin<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = size;
  info.usage = usage;
  if (device_.vk.vkCreateBuffer(device_.host.device, &info, nullptr, &buffer) != VK_SUCCESS) {
    return gpuError("vkCreateBuffer failed");
  }
  VkMemoryRequirements requirements{};
  device_.vk.vkGetBufferMemoryRequirements(device_.host.device, buffer, &requirements);
  const VkMemoryPropertyFlags visible = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  if (auto done = allocate(requirements, visible); !done) return done;
  device_.vk.vkBindBufferMemory(device_.host.device, buffer, memory_, 0);
  void* data = nullptr;
  if (device_.vk.vkMapMemory(device_.host.device, memory_, 0, VK_WHOLE_SIZE, 0, &data) != VK_SUCCESS) {
    return gpuError("vkMapMemory failed");
  }
  mapped = static_cast<float*>(data);
  return {};
}

Result<void> Target::makeImage(VkFormat format, std::uint32_t width, std::uint32_t height) {
  auto info = begin<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = format;
  info.extent = {width, height, 1};
  info.mipLevels = info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.usage = VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT |
               VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  if (device_.vk.vkCreateImage(device_.host.device, &info, nullptr, &image) != VK_SUCCESS) {
    return gpuError("vkCreateImage failed");
  }
  VkMemoryRequirements requirements{};
  device_.vk.vkGetImageMemoryRequirements(device_.host.device, image, &requirements);
  if (auto done = allocate(requirements, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT); !done) return done;
  device_.vk.vkBindImageMemory(device_.host.device, image, memory_, 0);
  auto viewInfo = begin<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  viewInfo.image = image;
  viewInfo.viewType = VK_IMAGE_VIEW_TYPE_2D;
  viewInfo.format = format;
  viewInfo.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  if (device_.vk.vkCreateImageView(device_.host.device, &viewInfo, nullptr, &view) != VK_SUCCESS) {
    return gpuError("vkCreateImageView failed");
  }
  return {};
}

VkDeviceAddress Target::address() const {
  auto info = begin<VkBufferDeviceAddressInfo>(VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO);
  info.buffer = buffer;
  return device_.vk.vkGetBufferDeviceAddress(device_.host.device, &info);
}

Result<void> Target::allocate(const VkMemoryRequirements& requirements, VkMemoryPropertyFlags wanted) {
  VkPhysicalDeviceMemoryProperties types{};
  device_.vk.vkGetPhysicalDeviceMemoryProperties(device_.host.physicalDevice, &types);
  auto flags = begin<VkMemoryAllocateFlagsInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO);
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  auto info = begin<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  info.pNext = buffer != VK_NULL_HANDLE ? &flags : nullptr;
  info.allocationSize = requirements.size;
  for (; info.memoryTypeIndex < types.memoryTypeCount; ++info.memoryTypeIndex) {
    const bool allowed = (requirements.memoryTypeBits >> info.memoryTypeIndex & 1u) != 0;
    if (allowed && (types.memoryTypes[info.memoryTypeIndex].propertyFlags & wanted) == wanted) break;
  }
  if (info.memoryTypeIndex == types.memoryTypeCount) return gpuError("no memory type fits");
  if (device_.vk.vkAllocateMemory(device_.host.device, &info, nullptr, &memory_) != VK_SUCCESS) {
    return gpuError("the GPU is out of memory");
  }
  return {};
}

}  // namespace billow::headless
