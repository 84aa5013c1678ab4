#include "stream/uploader.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "debug.h"

namespace billow::runtime {
namespace {

constexpr std::uint64_t kMostWait = 10'000'000'000;            // nanoseconds
constexpr std::uint64_t kLeastPiece = std::uint64_t{4} << 10;  // of a buffer, unless it ends before

}  // namespace

Uploader::~Uploader() {
  const VkDevice device = device_.host.device;
  const auto* callbacks = device_.host.allocationCallbacks;
  if (pool_ != VK_NULL_HANDLE) device_.api.vkDestroyCommandPool(device, pool_, callbacks);
  if (semaphore_ != VK_NULL_HANDLE) device_.api.vkDestroySemaphore(device, semaphore_, callbacks);
}

void Uploader::finish() {
  const std::uint64_t value = submitted_;
  if (value == 0) return;
  auto info = begin<VkSemaphoreWaitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO);
  info.semaphoreCount = 1;
  info.pSemaphores = &semaphore_;
  info.pValues = &value;
  // A lost device says so at once.
  (void)device_.api.vkWaitSemaphores(device_.host.device, &info, kMostWait);
}

Result<void> Uploader::create(std::uint64_t stagingBytes) {
  auto ring = StagingRing::make(device_, stagingBytes);
  if (!ring) return tl::unexpected(ring.error());
  ring_ = std::move(*ring);
  auto empty =
      Image::make(device_, "billow empty atlas", {.format = AtlasShape{}.format(), .extent = AtlasShape{}.extent()});
  if (!empty) return tl::unexpected(empty.error());
  emptyAtlas_ = std::move(*empty);
  if (auto bound = emptyAtlas_.bind(); !bound) return bound;
  return createCommands();
}

Result<void> Uploader::createCommands() {
  const VkDevice device = device_.host.device;
  const auto* callbacks = device_.host.allocationCallbacks;
  auto poolInfo = begin<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
  poolInfo.flags = VK_COMMAND_POOL_CREATE_TRANSIENT_BIT | VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  poolInfo.queueFamilyIndex = device_.host.uploadFamily;
  VkResult result = device_.api.vkCreateCommandPool(device, &poolInfo, callbacks, &pool_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateCommandPool", result);
  auto type = begin<VkSemaphoreTypeCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO);
  type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
  auto info = begin<VkSemaphoreCreateInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO);
  info.pNext = &type;
  result = device_.api.vkCreateSemaphore(device, &info, callbacks, &semaphore_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateSemaphore", result);
  nameObject(device_, VK_OBJECT_TYPE_SEMAPHORE, semaphore_, "billow uploads");
  auto allocation = begin<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
  allocation.commandPool = pool_;
  allocation.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocation.commandBufferCount = kBatches;
  result = device_.api.vkAllocateCommandBuffers(device, &allocation, commands_.data());
  if (result != VK_SUCCESS) return vulkanError("vkAllocateCommandBuffers", result);
  return {};
}

Result<std::uint64_t> Uploader::completed() const {
  std::uint64_t value = 0;
  const VkResult result = device_.api.vkGetSemaphoreCounterValue(device_.host.device, semaphore_, &value);
  if (result != VK_SUCCESS) return vulkanError("vkGetSemaphoreCounterValue", result);
  // The device may be done before vkQueueSubmit2() is, which still looks at the command buffers.
  return std::min<std::uint64_t>(value, submitted_);
}

Result<void> Uploader::copy(Upload& upload) {
  const std::uint64_t unit = upload.atlas.empty() ? 0 : unitOf(upload.shape).bytes;
  if (unit > ring_.space.size()) {
    return failure(ErrorCode::unsupported, "the upload queue copies images in parts of " + std::to_string(unit) +
                                               " bytes, for which stagingBytes is too small");
  }
  const auto opened = open();
  if (!opened) return tl::unexpected(opened.error());
  if (!*opened) return {};
  const auto buffer = copyBuffer(upload);
  if (!buffer) return tl::unexpected(buffer.error());
  if (!*buffer) return {};
  const auto atlas = copyAtlas(upload);
  if (!atlas) return tl::unexpected(atlas.error());
  upload.copied = *atlas;
  // Where nothing had to be copied: the batch that makes the empty atlas readable, or a later one.
  if (*atlas) upload.batch = std::max(upload.batch, closed_ + 1);
  return {};
}

Result<bool> Uploader::open() {
  const auto done = completed();
  if (!done) return tl::unexpected(done.error());
  seen_ = *done;
  ring_.ends.executed(*done, ring_.space);
  if (recording_ != VK_NULL_HANDLE) return true;
  if (closed_ - *done >= kBatches) return false;
  const VkCommandBuffer commands = commands_[(closed_ + 1) % kBatches];
  auto info = begin<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  const VkResult result = device_.api.vkBeginCommandBuffer(commands, &info);
  if (result != VK_SUCCESS) return vulkanError("vkBeginCommandBuffer", result);
  recording_ = commands;
  if (!emptyReady_) {
    changeLayout(device_.api, recording_, emptyAtlas_.handle(), VK_IMAGE_LAYOUT_UNDEFINED,
                 VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
  }
  emptyReady_ = true;
  return true;
}

Result<void> Uploader::close() {
  if (recording_ == VK_NULL_HANDLE) return {};
  const VkResult result = device_.api.vkEndCommandBuffer(std::exchange(recording_, VK_NULL_HANDLE));
  if (result != VK_SUCCESS) return vulkanError("vkEndCommandBuffer", result);
  ring_.ends.close(closed_ + 1, ring_.space);
  recordedBytes_ = 0;
  ++closed_;
  if (closedCall_.call != nullptr) closedCall_.call(closedCall_.context);
  return {};
}

Result<void> Uploader::submit() {
  const std::uint64_t last = closed_;
  const std::uint64_t first = submitted_ + 1;
  if (last < first) return {};
  std::array<VkCommandBufferSubmitInfo, kBatches> commands;
  std::array<VkSemaphoreSubmitInfo, kBatches> signals;
  std::array<VkSubmitInfo2, kBatches> infos;
  std::uint32_t count = 0;
  for (std::uint64_t batch = first; batch <= last; ++batch, ++count) {
    commands[count] = begin<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
    commands[count].commandBuffer = commands_[batch % kBatches];
    signals[count] = begin<VkSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO);
    signals[count].semaphore = semaphore_;
    signals[count].value = batch;
    signals[count].stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    infos[count] = begin<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
    infos[count].commandBufferInfoCount = 1;
    infos[count].pCommandBufferInfos = &commands[count];
    infos[count].signalSemaphoreInfoCount = 1;
    infos[count].pSignalSemaphoreInfos = &signals[count];
  }
  const VkResult result = device_.api.vkQueueSubmit2(device_.host.uploadQueue, count, infos.data(), VK_NULL_HANDLE);
  if (result != VK_SUCCESS) return vulkanError("vkQueueSubmit2", result);
  submitted_ = last;
  return {};
}

Result<bool> Uploader::room() {
  if (recordedBytes_ >= ring_.space.size() / 4) {
    if (auto closed = close(); !closed) return tl::unexpected(closed.error());
  }
  return open();
}

RingSpace::Piece Uploader::take(std::uint64_t least, std::uint64_t most, std::uint64_t unit) {
  // A quarter at a time: the next piece is filled while the device reads the one before.
  const std::uint64_t quarter = ring_.space.size() / 4;
  return ring_.space.take(least, std::max(least, std::min(most, quarter)), unit);
}

// False where the ring is full.
Result<bool> Uploader::copyBuffer(Upload& upload) {
  while (upload.bufferDone < upload.buffer.size()) {
    const auto ready = room();
    if (!ready || !*ready) return ready;
    const std::uint64_t left = upload.buffer.size() - upload.bufferDone;
    const RingSpace::Piece piece = take(std::min(left, kLeastPiece), left, 4);
    if (piece.bytes == 0) return false;
    const DebugLabel label(device_.api, recording_, "billow upload buffer");
    std::memcpy(ring_.bytes(piece).data(), upload.buffer.data() + upload.bufferDone, piece.bytes);
    const VkBufferCopy copy{piece.offset, upload.target->buffer.offset + upload.bufferDone, piece.bytes};
    device_.api.vkCmdCopyBuffer(recording_, ring_.buffer(), upload.target->bufferHandle(), 1, &copy);
    upload.bufferDone += piece.bytes;
    upload.begun = true;
    upload.batch = closed_ + 1;
    bytesUploaded_ += piece.bytes;
    recordedBytes_ += piece.bytes;
  }
  return true;
}

Uploader::AtlasUnit Uploader::unitOf(const AtlasShape& shape) const {
  const VkExtent3D& granularity = device_.uploadGranularity;
  const VkExtent3D extent = shape.extent();
  const std::uint32_t rows = extent.height / 4;
  const std::uint64_t rowBytes = std::uint64_t{extent.width / 4} * 16;
  if (granularity.width == 1 && granularity.height == 1 && granularity.depth == 1) {
    return {.bytes = rowBytes, .rows = rows, .slices = 0};
  }
  // Queues that copy coarser parts, or whole images alone, get whole slices; a part that ends with the image may be
  // smaller.
  const std::uint32_t slices = granularity.depth == 0 ? extent.depth : std::min(granularity.depth, extent.depth);
  return {.bytes = rowBytes * rows * slices, .rows = 0, .slices = slices};
}

Result<bool> Uploader::copyAtlas(Upload& upload) {
  if (upload.atlas.empty()) return true;
  const AtlasUnit unit = unitOf(upload.shape);
  const std::uint64_t bytes = upload.atlas.size();
  while (upload.atlasDone * unit.bytes < bytes) {
    const auto ready = room();
    if (!ready || !*ready) return ready;
    const std::uint64_t at = upload.atlasDone * unit.bytes;
    const std::uint64_t least = std::min(unit.bytes, bytes - at);
    const RingSpace::Piece piece = take(least, bytes - at, least);
    if (piece.bytes == 0) return false;
    const DebugLabel label(device_.api, recording_, "billow upload atlas");
    if (at == 0) {
      changeLayout(device_.api, recording_, upload.target->image, VK_IMAGE_LAYOUT_UNDEFINED,
                   VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    }
    std::memcpy(ring_.bytes(piece).data(), upload.atlas.data() + at, piece.bytes);
    const std::uint64_t units = (piece.bytes + unit.bytes - 1) / unit.bytes;
    recordAtlas(upload, unit, piece.offset, units);
    upload.atlasDone += units;
    upload.begun = true;
    upload.batch = closed_ + 1;
    bytesUploaded_ += piece.bytes;
    recordedBytes_ += piece.bytes;
  }
  changeLayout(device_.api, recording_, upload.target->image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
               VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
  return true;
}

// Copies of the next `units`: the rest of a slice, whole slices, the beginning of one.
void Uploader::recordAtlas(const Upload& upload, const AtlasUnit& unit, std::uint64_t ringOffset, std::uint64_t units) {
  const VkExtent3D extent = upload.shape.extent();
  std::array<VkBufferImageCopy, 3> copies{};
  std::uint32_t count = 0;
  const auto add = [&](std::uint32_t row, std::uint32_t rows, std::uint32_t slice, std::uint32_t slices) {
    VkBufferImageCopy& copy = copies[count++];
    copy.bufferOffset = ringOffset;
    copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    copy.imageOffset = {0, static_cast<std::int32_t>(row * 4), static_cast<std::int32_t>(slice)};
    copy.imageExtent = {extent.width, rows * 4, slices};
    ringOffset += std::uint64_t{extent.width / 4} * 16 * rows * slices;
  };
  if (unit.rows == 0) {
    const auto slice = static_cast<std::uint32_t>(upload.atlasDone * unit.slices);
    const auto slices = std::min(static_cast<std::uint32_t>(units * unit.slices), extent.depth - slice);
    add(0, extent.height / 4, slice, slices);
  } else {
    auto at = static_cast<std::uint32_t>(upload.atlasDone), left = static_cast<std::uint32_t>(units);
    while (left != 0) {
      const std::uint32_t row = at % unit.rows;
      const bool whole = row == 0 && left >= unit.rows;
      const std::uint32_t slices = whole ? left / unit.rows : 1;
      const std::uint32_t rows = whole ? unit.rows : std::min(left, unit.rows - row);
      add(row, rows, at / unit.rows, slices);
      at += rows * slices;
      left -= rows * slices;
    }
  }
  device_.api.vkCmdCopyBufferToImage(recording_, ring_.buffer(), upload.target->image,
                                     VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, count, copies.data());
}

}  // namespace billow::runtime
