#include "stream/gpu_heap.h"

#include <algorithm>
#include <string>
#include <tuple>

#include "debug.h"

namespace billow::runtime {
namespace {

constexpr std::uint64_t kPage = std::uint64_t{64} << 10;  // blocks are multiples
constexpr std::uint64_t kOneBlockBelow = std::uint64_t{64} << 20;
constexpr std::uint64_t kBlocks = 16;

constexpr VkBufferUsageFlags kBufferUsage =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;

constexpr std::uint32_t kTriesLeftOut = 256;  // for another block, after the device had no memory for one

// Where memory is short the one frame fails that wanted it; all else is the device's failure.
tl::unexpected<Error> heapError(const char* call, VkResult result) {
  auto error = vulkanError(call, result);
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY) {
    error.value().code = ErrorCode::memory;
  }
  return error;
}

Result<VkBuffer> makeBuffer(const Device& device, std::uint64_t bytes, VkMemoryRequirements& needs) {
  auto info = begin<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
  info.size = bytes;
  info.usage = kBufferUsage;
  std::uint32_t families[2];
  shareFamilies(device, info, families);
  VkBuffer buffer = VK_NULL_HANDLE;
  const VkResult result =
      device.api.vkCreateBuffer(device.host.device, &info, device.host.allocationCallbacks, &buffer);
  if (result != VK_SUCCESS) return heapError("vkCreateBuffer", result);
  device.api.vkGetBufferMemoryRequirements(device.host.device, buffer, &needs);
  return buffer;
}

std::array<std::uint32_t, 3> keyOf(const AtlasShape& shape) {
  return {shape.xBits, shape.yBits, shape.layers};
}

}  // namespace

HeapMemory::~HeapMemory() {
  const Device& device = heap_.device_;
  const auto* callbacks = device.host.allocationCallbacks;
  if (view != VK_NULL_HANDLE) device.api.vkDestroyImageView(device.host.device, view, callbacks);
  if (image != VK_NULL_HANDLE) device.api.vkDestroyImage(device.host.device, image, callbacks);
  const std::lock_guard lock(heap_.mutex_);
  heap_.release(buffer);
  heap_.release(atlas);
}

GpuHeap::~GpuHeap() {
  for (const auto& block : blocks_) destroy(*block);
}

Result<void> GpuHeap::create() {
  granule_ = std::max<std::uint64_t>(granule_, device_.imageGranularity);
  VkMemoryRequirements needs{};
  const auto buffer = makeBuffer(device_, kPage, needs);
  if (!buffer) return tl::unexpected(buffer.error());
  device_.api.vkDestroyBuffer(device_.host.device, *buffer, device_.host.allocationCallbacks);
  granule_ = std::max<std::uint64_t>(granule_, needs.alignment);
  std::uint32_t images = needs.memoryTypeBits;
  if (device_.bc7) {
    const auto image = imageNeeds({.xBits = 0, .yBits = 0, .layers = 1});
    if (!image) return tl::unexpected(image.error());
    images = image->memoryTypeBits;
  }
  const auto both = memoryType(device_, needs.memoryTypeBits & images, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  const auto first = both ? both : memoryType(device_, needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  const auto second = both ? both : memoryType(device_, images, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  if (!first || !second) return tl::unexpected((!first ? first : second).error());
  bufferType_ = *first;
  imageType_ = *second;
  return {};
}

Result<VkImage> GpuHeap::makeImage(const AtlasShape& shape) {
  auto info = begin<VkImageCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO);
  info.imageType = VK_IMAGE_TYPE_3D;
  info.format = shape.format();
  info.extent = shape.extent();
  info.mipLevels = 1;
  info.arrayLayers = 1;
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.tiling = VK_IMAGE_TILING_OPTIMAL;
  info.usage = VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT;
  info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  std::uint32_t families[2];
  shareFamilies(device_, info, families);
  VkImage image = VK_NULL_HANDLE;
  const VkResult result =
      device_.api.vkCreateImage(device_.host.device, &info, device_.host.allocationCallbacks, &image);
  if (result != VK_SUCCESS) return heapError("vkCreateImage", result);
  return image;
}

// Shapes come again and again, and the device's answer is always the same.
Result<VkMemoryRequirements> GpuHeap::imageNeeds(const AtlasShape& shape) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = imageNeeds_.find(keyOf(shape)); known != imageNeeds_.end()) return known->second;
  }
  const auto image = makeImage(shape);
  if (!image) return tl::unexpected(image.error());
  VkMemoryRequirements needs{};
  device_.api.vkGetImageMemoryRequirements(device_.host.device, *image, &needs);
  device_.api.vkDestroyImage(device_.host.device, *image, device_.host.allocationCallbacks);
  const std::lock_guard lock(mutex_);
  if (imageNeeds_.size() >= 4096) imageNeeds_.clear();
  return imageNeeds_[keyOf(shape)] = needs;
}

Result<std::uint64_t> GpuHeap::need(std::uint64_t bufferBytes, const AtlasShape& shape) {
  if (shape.layers == 0) return aligned(bufferBytes);
  const auto image = imageNeeds(shape);
  if (!image) return tl::unexpected(image.error());
  return aligned(bufferBytes) + aligned(image->size);
}

Result<std::unique_ptr<HeapMemory>> GpuHeap::allocate(std::uint64_t bufferBytes, const AtlasShape& shape) {
  auto memory = std::make_unique<HeapMemory>(*this);
  VkMemoryRequirements image{};
  if (shape.layers != 0) {
    const auto needs = imageNeeds(shape);
    if (!needs) return tl::unexpected(needs.error());
    image = *needs;
  }
  {
    const std::lock_guard lock(mutex_);
    const std::uint64_t bytes = aligned(bufferBytes) + aligned(image.size);
    if (bytes > budget_) {
      return failure(ErrorCode::budget, "the frame takes " + std::to_string(bytes) +
                                            " bytes of GPU memory, which the " + std::to_string(budget_) +
                                            " of gpuBudget do not hold");
    }
    if (std::max(aligned(bufferBytes), aligned(image.size)) > device_.mostAllocation / kPage * kPage) {
      return failure(ErrorCode::budget, "the frame takes more GPU memory than the " +
                                            std::to_string(device_.mostAllocation) +
                                            " bytes that the device allocates at once");
    }
    for (const auto& [part, needed, alignment] : {std::tuple{&memory->buffer, aligned(bufferBytes), granule_},
                                                  std::tuple{&memory->atlas, aligned(image.size), image.alignment}}) {
      if (needed == 0) continue;
      const auto taken = take(needed, std::max<std::uint64_t>(alignment, granule_), part == &memory->atlas);
      if (!taken) return tl::unexpected(taken.error());
      *part = *taken;
      if (part->block == nullptr) break;
    }
    if ((bufferBytes != 0 && memory->buffer.block == nullptr) || (image.size != 0 && memory->atlas.block == nullptr)) {
      release(std::exchange(memory->buffer, {}));
      if (used_ != 0) return std::unique_ptr<HeapMemory>();
      return failure(ErrorCode::budget, "the frame takes " + std::to_string(bytes) +
                                            " bytes of GPU memory, for which the budgets leave no block");
    }
  }
  if (shape.layers == 0) return memory;
  if (auto bound = bindImage(shape, *memory); !bound) return tl::unexpected(bound.error());
  return memory;
}

Result<void> GpuHeap::bindImage(const AtlasShape& shape, HeapMemory& memory) {
  const auto image = makeImage(shape);
  if (!image) return tl::unexpected(image.error());
  memory.image = *image;
  nameObject(device_, VK_OBJECT_TYPE_IMAGE, memory.image, "billow frame atlas");
  VkResult result =
      device_.api.vkBindImageMemory(device_.host.device, memory.image, memory.atlas.block->memory, memory.atlas.offset);
  if (result != VK_SUCCESS) return heapError("vkBindImageMemory", result);
  auto info = begin<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
  info.image = memory.image;
  info.viewType = VK_IMAGE_VIEW_TYPE_3D;
  info.format = shape.format();
  info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
  result = device_.api.vkCreateImageView(device_.host.device, &info, device_.host.allocationCallbacks, &memory.view);
  if (result != VK_SUCCESS) return heapError("vkCreateImageView", result);
  return {};
}

Result<GpuHeap::Part> GpuHeap::take(std::uint64_t bytes, std::uint64_t alignment, bool image) {
  const bool apart = image && imageType_ != bufferType_;
  Part part = takeOfBlocks(bytes, alignment, apart);
  if (part.block == nullptr) {
    const std::uint64_t size = newBlockBytes(bytes);
    if (size == 0) return Part{};
    const auto added = addBlock(size, apart);
    if (!added) return tl::unexpected(added.error());
    if (*added == nullptr) return Part{};
    part = takeOfBlocks(bytes, alignment, apart);
  }
  used_ += part.bytes;
  return part;
}

GpuHeap::Part GpuHeap::takeOfBlocks(std::uint64_t bytes, std::uint64_t alignment, bool image) {
  HeapBlock* best = nullptr;
  std::uint64_t least = ~std::uint64_t{0};
  for (const auto& block : blocks_) {
    if (block->leaving || block->images != image) continue;
    const auto fit = block->ranges.fit(bytes, alignment);
    if (!fit || *fit >= least) continue;
    best = block.get();
    least = *fit;
  }
  if (best == nullptr) return {};
  return {best, *best->ranges.allocate(bytes, alignment), bytes};
}

// How large a block to add for so many bytes; 0 where the budget holds none.
std::uint64_t GpuHeap::newBlockBytes(std::uint64_t bytes) {
  const std::uint64_t usual = std::max(budget_ < kOneBlockBelow ? budget_ : budget_ / kBlocks, bytes);
  const std::uint64_t least = (bytes + kPage - 1) / kPage * kPage;
  if (exhausted_ != 0 && --exhausted_ != 0) return 0;
  const auto room = [&] { return budget_ > allocated_ ? budget_ - allocated_ : 0; };
  if (room() < least) dropEmpty(true);
  // The host's budget for all of billow may be the tighter one.
  const std::uint64_t device = device_.budget - std::min<std::uint64_t>(device_.used, device_.budget);
  const std::uint64_t most = std::min({room(), device, device_.mostAllocation}) / kPage * kPage;
  if (most < least) return 0;
  return std::clamp((usual + kPage - 1) / kPage * kPage, least, most);
}

Result<HeapBlock*> GpuHeap::addBlock(std::uint64_t bytes, bool image) {
  auto block = std::make_unique<HeapBlock>(bytes);
  block->images = image;
  blocks_.reserve(blocks_.size() + 1);
  const auto filled = fillBlock(*block, bytes);
  if (!filled) {
    destroy(*block);
    if (filled.error().code != ErrorCode::memory) return tl::unexpected(filled.error());
    // Frames of blocks that there are may make room.
    if (blocks_.empty()) return tl::unexpected(filled.error());
    exhausted_ = kTriesLeftOut;
    return nullptr;
  }
  blocks_.push_back(std::move(block));
  return blocks_.back().get();
}

Result<void> GpuHeap::fillBlock(HeapBlock& block, std::uint64_t bytes) {
  VkMemoryRequirements needs{.size = bytes, .alignment = 1, .memoryTypeBits = 0};
  if (!block.images) {
    const auto buffer = makeBuffer(device_, bytes, needs);
    if (!buffer) return tl::unexpected(buffer.error());
    block.buffer = *buffer;
    nameObject(device_, VK_OBJECT_TYPE_BUFFER, block.buffer, "billow frames");
  }
  if (needs.size > budget_ - std::min<std::uint64_t>(allocated_, budget_) || !takeBytes(device_, needs.size)) {
    return failure(ErrorCode::memory, "the budget does not hold a block of " + std::to_string(needs.size) + " bytes");
  }
  block.allocated = needs.size;
  allocated_ += needs.size;
  peak_ = std::max<std::uint64_t>(peak_, allocated_);
  auto flags = begin<VkMemoryAllocateFlagsInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO);
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  auto info = begin<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
  info.pNext = block.images ? nullptr : &flags;
  info.allocationSize = needs.size;
  info.memoryTypeIndex = block.images ? imageType_ : bufferType_;
  const VkDevice device = device_.host.device;
  VkResult result = device_.api.vkAllocateMemory(device, &info, device_.host.allocationCallbacks, &block.memory);
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY || result == VK_ERROR_OUT_OF_HOST_MEMORY) {
    return failure(ErrorCode::memory, "the device has no memory for a block of " + std::to_string(needs.size));
  }
  if (result != VK_SUCCESS) return vulkanError("vkAllocateMemory", result);
  if (block.images) return {};
  result = device_.api.vkBindBufferMemory(device, block.buffer, block.memory, 0);
  if (result != VK_SUCCESS) return heapError("vkBindBufferMemory", result);
  auto address = begin<VkBufferDeviceAddressInfo>(VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO);
  address.buffer = block.buffer;
  block.address = device_.api.vkGetBufferDeviceAddress(device, &address);
  return {};
}

void GpuHeap::destroy(HeapBlock& block) {
  const VkDevice device = device_.host.device;
  const auto* callbacks = device_.host.allocationCallbacks;
  if (block.buffer != VK_NULL_HANDLE) device_.api.vkDestroyBuffer(device, block.buffer, callbacks);
  if (block.memory != VK_NULL_HANDLE) device_.api.vkFreeMemory(device, block.memory, callbacks);
  device_.used -= block.allocated;
  allocated_ -= block.allocated;
}

void GpuHeap::release(const Part& part) {
  if (part.block == nullptr) return;
  part.block->ranges.release(part.offset, part.bytes);
  used_ -= part.bytes;
  if (part.block->ranges.used() == 0) dropEmpty(false);
}

// Blocks of an unusual size and those that are over the budget; or all.
void GpuHeap::dropEmpty(bool all) {
  const std::uint64_t usual = budget_ < kOneBlockBelow ? budget_ : budget_ / kBlocks + kPage;
  std::erase_if(blocks_, [&](const std::unique_ptr<HeapBlock>& block) {
    if (block->ranges.used() != 0) return false;
    if (!all && !block->leaving && block->ranges.size() <= usual && allocated_ <= budget_) return false;
    destroy(*block);
    exhausted_ = 0;
    return true;
  });
  chooseLeaving();
}

void GpuHeap::setBudget(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  budget_ = bytes;
  exhausted_ = 0;
  dropEmpty(false);
}

// The least full blocks leave, until those that stay fit into the budget.
void GpuHeap::chooseLeaving() {
  for (const auto& block : blocks_) block->leaving = false;
  std::uint64_t staying = allocated_;
  while (staying > budget_) {
    HeapBlock* least = nullptr;
    for (const auto& block : blocks_) {
      if (block->leaving || (least != nullptr && least->ranges.used() <= block->ranges.used())) continue;
      least = block.get();
    }
    least->leaving = true;
    staying -= least->allocated;
  }
}

bool GpuHeap::leaving(const HeapMemory& memory) const {
  const std::lock_guard lock(mutex_);
  return (memory.buffer.block != nullptr && memory.buffer.block->leaving) ||
         (memory.atlas.block != nullptr && memory.atlas.block->leaving);
}

}  // namespace billow::runtime
