// Buffers and images with memory of their own; every byte counts against the budget.
#ifndef BILLOW_RUNTIME_MEMORY_H
#define BILLOW_RUNTIME_MEMORY_H

#include <cstddef>
#include <span>

#include "api.h"

namespace billow::runtime {

enum class Placement { device, mapped };

// The first memory type of `allowed` (a bit each) that has all properties `wanted`.
Result<std::uint32_t> memoryType(const Device& device, std::uint32_t allowed, VkMemoryPropertyFlags wanted);

// Shares a buffer or image between the upload and the draw family; `families` lives until it is created.
template <class Info>
void shareFamilies(const Device& device, Info& info, std::uint32_t (&families)[2]) {
  families[0] = device.host.uploadFamily;
  families[1] = device.host.drawFamily;
  if (families[0] == families[1]) return;
  info.sharingMode = VK_SHARING_MODE_CONCURRENT;
  info.queueFamilyIndexCount = 2;
  info.pQueueFamilyIndices = families;
}

// An object is created first, which tells its size; bind() then allocates. So a frame is checked against the budget
// before anything is allocated.
class Buffer {
 public:
  Buffer() = default;
  Buffer(Buffer&& other) noexcept { *this = std::move(other); }
  Buffer& operator=(Buffer&& other) noexcept;
  ~Buffer() { reset(); }

  // `name` is what debuggers call it.
  static Result<Buffer> make(Device& device, const char* name, std::uint64_t size, VkBufferUsageFlags usage);
  Result<void> bind(Placement placement);
  void reset();

  VkBuffer handle() const { return buffer_; }
  std::uint64_t allocationSize() const { return requirements_.size; }
  VkDeviceAddress address() const;  // of buffers with shader device address usage
  std::span<std::byte> mapped() const { return mapped_; }

 private:
  Device* device_ = nullptr;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkMemoryRequirements requirements_{};
  std::uint64_t size_ = 0;
  bool addressable_ = false;
  std::span<std::byte> mapped_;
};

struct ImageShape {
  VkFormat format = VK_FORMAT_UNDEFINED;
  VkExtent3D extent{};
  VkImageType type = VK_IMAGE_TYPE_3D;
  VkImageUsageFlags usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
};

class Image {
 public:
  Image() = default;
  Image(Image&& other) noexcept { *this = std::move(other); }
  Image& operator=(Image&& other) noexcept;
  ~Image() { reset(); }

  // One level, one layer; concurrent where the host's upload and draw families differ.
  static Result<Image> make(Device& device, const char* name, const ImageShape& shape);
  Result<void> bind();
  void reset();

  VkImage handle() const { return image_; }
  VkImageView view() const { return view_; }
  VkExtent3D extent() const { return shape_.extent; }
  std::uint64_t allocationSize() const { return requirements_.size; }

 private:
  Device* device_ = nullptr;
  ImageShape shape_;
  VkImage image_ = VK_NULL_HANDLE;
  VkImageView view_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkMemoryRequirements requirements_{};
};

// Of an image of one level and layer that is written by copies: from undefined, to be copied to or to be read, and from
// copied to, to be read. Whoever reads it waits for the upload.
void changeLayout(const Api& api, VkCommandBuffer commands, VkImage image, VkImageLayout from, VkImageLayout to);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_MEMORY_H
