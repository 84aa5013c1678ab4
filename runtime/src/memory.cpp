#include "memory.h"

#include <utility>

#include "debug.h"

namespace billow::runtime {
namespace {

Result<VkDeviceMemory> allocate(Device& device, const VkMemoryRequirements& requirements, VkMemoryPropertyFlags wanted,
                                bool addressable) {
  const auto type = memoryType(device, requirements.memoryTypeBits, wanted);
  if (!type) return tl::unexpected(type.error());
  if (!takeBytes(device, requirements.size)) {
    return failure(ErrorCode::budget, "an allocation of " + std::to_string(requirements.size) +
                                          " bytes would exceed the GPU budget of " + std::to_string(device.budget));
  }
  auto flags = begin<VkMemoryAllocateFlagsInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO);
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  auto info = begin<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  info.pNext = addressable ? &flags : nullptr;
  info.allocationSize = requirements.size;
  info.memoryTypeIndex = *type;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  const VkResult result =
      device.api.vkAllocateMemory(device.host.device, &info, device.host.allocationCallbacks, &memory);
  if (result == VK_SUCCESS) return memory;
  device.used -= requirements.size;
  return vulkanError("vkAllocateMemory", result);
}

}  // namespace

Result<std::uint32_t> memoryType(const Device& device, std::uint32_t allowed, VkMemoryPropertyFlags wanted) {
  for (std::uint32_t i = 0; i < device.memory.memoryTypeCount; ++i) {
    const bool fits = (device.memory.memoryTypes[i].propertyFlags & wanted) == wanted;
    if (fits && (allowed >> i & 1u) != 0) return i;
  }
  return failure(ErrorCode::unsupported, "the device has no memory of the kind that a buffer or image needs");
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  if (this == &other) return *this;
  reset();
  device_ = std::exchange(other.device_, nullptr);
  buffer_ = std::exchange(other.buffer_, VK_NULL_HANDLE);
  memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
  requirements_ = other.requirements_;
  size_ = other.size_;
  addressable_ = other.addressable_;
  mapped_ = std::exchange(other.mapped_, {});
  return *this;
}

Result<Buffer> Buffer::make(Device& device, const char* name, std::uint64_t size, VkBufferUsageFlags usage) {
  Buffer buffer;
  buffer.device_ = &device;
  buffer.size_ = size;
  buffer.addressable_ = (usage & VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT) != 0;
  auto info = begin<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = size;
  info.usage = usage;
  std::uint32_t families[2];
  shareFamilies(device, info, families);
  const VkResult result =
      device.api.vkCreateBuffer(device.host.device, &info, device.host.allocationCallbacks, &buffer.buffer_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateBuffer", result);
  nameObject(device, VK_OBJECT_TYPE_BUFFER, buffer.buffer_, name);
  device.api.vkGetBufferMemoryRequirements(device.host.device, buffer.buffer_, &buffer.requirements_);
  return buffer;
}

Result<void> Buffer::bind(Placement placement) {
  const bool map = placement == Placement::mapped;
  const VkMemoryPropertyFlags wanted = map ? VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT
                                           : VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
  const auto memory = allocate(*device_, requirements_, wanted, addressable_);
  if (!memory) return tl::unexpected(memory.error());
  memory_ = *memory;
  const VkDevice device = device_->host.device;
  VkResult result = device_->api.vkBindBufferMemory(device, buffer_, memory_, 0);
  if (result != VK_SUCCESS) return vulkanError("vkBindBufferMemory", result);
  if (!map) return {};
  void* data = nullptr;
  result = device_->api.vkMapMemory(device, memory_, 0, VK_WHOLE_SIZE, 0, &data);
  if (result != VK_SUCCESS) return vulkanError("vkMapMemory", result);
  mapped_ = {static_cast<std::byte*>(data), static_cast<std::size_t>(size_)};
  return {};
}

void Buffer::reset() {
  if (device_ == nullptr) return;
  if (buffer_ != VK_NULL_HANDLE)
    device_->api.vkDestroyBuffer(device_->host.device, buffer_, device_->host.allocationCallbacks);
  if (memory_ != VK_NULL_HANDLE) {
    device_->api.vkFreeMemory(device_->host.device, memory_, device_->host.allocationCallbacks);
    device_->used -= requirements_.size;
  }
  buffer_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  mapped_ = {};
  device_ = nullptr;
}

VkDeviceAddress Buffer::address() const {
  auto info = begin<VkBufferDeviceAddressInfo>(VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO);
  info.buffer = buffer_;
  return device_->api.vkGetBufferDeviceAddress(device_->host.device, &info);
}

Image& Image::operator=(Image&& other) noexcept {
  if (this == &other) return *this;
  reset();
  device_ = std::exchange(other.device_, nullptr);
  shape_ = other.shape_;
  image_ = std::exchange(other.image_, VK_NULL_HANDLE);
  view_ = std::exchange(other.view_, VK_NULL_HANDLE);
  memory_ = std::exchange(other.memory_, VK_NULL_HANDLE);
  requirements_ = other.requirements_;
  return *this;
}

Result<Image> Image::make(Device& device, const char* name, const ImageShape& shape) {
  Image image;
  image.device_ = &device;
  image.shape_ = shape;
  auto info = begin<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = shape.type;
  info.format = shape.format;
  info.extent = shape.extent;
  info.mipLevels = 1;
  info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.tiling = VK_IMAGE_TILING_OPTIMAL;
  info.usage = shape.usage;
  info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  std::uint32_t families[2];
  shareFamilies(device, info, families);
  const VkResult result =
      device.api.vkCreateImage(device.host.device, &info, device.host.allocationCallbacks, &image.image_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateImage", result);
  nameObject(device, VK_OBJECT_TYPE_IMAGE, image.image_, name);
  device.api.vkGetImageMemoryRequirements(device.host.device, image.image_, &image.requirements_);
  return image;
}

Result<void> Image::bind() {
  const auto memory = allocate(*device_, requirements_, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, false);
  if (!memory) return tl::unexpected(memory.error());
  memory_ = *memory;
  const VkDevice device = device_->host.device;
  VkResult result = device_->api.vkBindImageMemory(device, image_, memory_, 0);
  if (result != VK_SUCCESS) return vulkanError("vkBindImageMemory", result);
  auto info = begin<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  info.image = image_;
  info.viewType = shape_.type == VK_IMAGE_TYPE_3D ? VK_IMAGE_VIEW_TYPE_3D : VK_IMAGE_VIEW_TYPE_2D;
  info.format = shape_.format;
  info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  result = device_->api.vkCreateImageView(device, &info, device_->host.allocationCallbacks, &view_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateImageView", result);
  return {};
}

void Image::reset() {
  if (device_ == nullptr) return;
  const VkDevice device = device_->host.device;
  if (view_ != VK_NULL_HANDLE) device_->api.vkDestroyImageView(device, view_, device_->host.allocationCallbacks);
  if (image_ != VK_NULL_HANDLE) device_->api.vkDestroyImage(device, image_, device_->host.allocationCallbacks);
  if (memory_ != VK_NULL_HANDLE) {
    device_->api.vkFreeMemory(device, memory_, device_->host.allocationCallbacks);
    device_->used -= requirements_.size;
  }
  image_ = VK_NULL_HANDLE;
  view_ = VK_NULL_HANDLE;
  memory_ = VK_NULL_HANDLE;
  device_ = nullptr;
}

void changeLayout(const Api& api, VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to) {
  auto barrier = begin<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
  const bool first = from == VK_IMAGE_LAYOUT_UNDEFINED;
  const bool copies = to == VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
  barrier.srcStageMask = first ? VK_PIPELINE_STAGE_2_NONE : VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
  barrier.srcAccessMask = first ? VK_ACCESS_2_NONE : VK_ACCESS_2_TRANSFER_WRITE_BIT;
  // Draws wait on the semaphore, which makes the image visible to them.
  barrier.dstStageMask = copies ? VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT : VK_PIPELINE_STAGE_2_NONE;
  barrier.dstAccessMask = copies ? VK_ACCESS_2_TRANSFER_WRITE_BIT : VK_ACCESS_2_NONE;
  barrier.oldLayout = from;
  barrier.newLayout = to;
  barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  barrier.image = image;
  barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  auto info = begin<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.imageMemoryBarrierCount = 1;
  info.pImageMemoryBarriers = &barrier;
  api.vkCmdPipelineBarrier2(commands, &info);
}

}  // namespace billow::runtime
