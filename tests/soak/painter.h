// Pictures of layers in two steps: commands are recorded now and executed later, as a game with several frames in
// flight does it. What they read must still be there.
#ifndef BILLOW_TESTS_SOAK_PAINTER_H
#define BILLOW_TESTS_SOAK_PAINTER_H

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "billow/headless/device.h"
#include "billow/headless/target.h"
#include "billow/runtime/stream.h"

namespace billow::tests {

inline constexpr std::uint32_t kSoakPictureEdge = 24;

class Painter {
 public:
  // One picture whose commands are recorded, and not executed yet.
  class Pending {
   public:
    Pending(const headless::VulkanDevice& device, const runtime::UploadWait& wait)
        : device_(device), wait_(wait), color_(device), depth_(device), readBack_(device) {}
    ~Pending() {
      if (pool_ != VK_NULL_HANDLE) device_.vk.vkDestroyCommandPool(device_.host.device, pool_, nullptr);
    }

    // Executes the commands and waits for them. Four floats a pixel.
    runtime::Result<std::vector<float>> picture() const {
      VkCommandBufferSubmitInfo commands{};
      commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
      commands.commandBuffer = commands_;
      VkSemaphoreSubmitInfo wait{};
      wait.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO;
      wait.semaphore = wait_.semaphore;
      wait.value = wait_.value;
      wait.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
      VkSubmitInfo2 info{};
      info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
      info.waitSemaphoreInfoCount = wait_.semaphore != VK_NULL_HANDLE ? 1 : 0;
      info.pWaitSemaphoreInfos = &wait;
      info.commandBufferInfoCount = 1;
      info.pCommandBufferInfos = &commands;
      VkResult result = device_.vk.vkQueueSubmit2(device_.host.uploadQueue, 1, &info, VK_NULL_HANDLE);
      if (result == VK_SUCCESS) result = device_.vk.vkQueueWaitIdle(device_.host.uploadQueue);
      if (result != VK_SUCCESS) return headless::gpuError("a picture fails with VkResult " + std::to_string(result));
      return std::vector<float>(readBack_.mapped, readBack_.mapped + kFloats);
    }

   private:
    friend class Painter;
    static constexpr std::size_t kFloats = std::size_t{kSoakPictureEdge} * kSoakPictureEdge * 4;

    runtime::Result<void> make() {
      if (auto done = color_.makeImage(VK_FORMAT_R32G32B32A32_SFLOAT, kSoakPictureEdge, kSoakPictureEdge); !done)
        return done;
      if (auto done = depth_.makeImage(VK_FORMAT_R32_SFLOAT, kSoakPictureEdge, kSoakPictureEdge); !done) return done;
      if (auto done = readBack_.makeBuffer(kFloats * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT); !done) return done;
      VkCommandPoolCreateInfo pool{};
      pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
      pool.queueFamilyIndex = device_.host.drawFamily;
      VkCommandBufferAllocateInfo info{};
      info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
      info.commandBufferCount = 1;
      if (device_.vk.vkCreateCommandPool(device_.host.device, &pool, nullptr, &pool_) != VK_SUCCESS ||
          (info.commandPool = pool_,
           device_.vk.vkAllocateCommandBuffers(device_.host.device, &info, &commands_) != VK_SUCCESS)) {
        return headless::gpuError("a picture's command buffer");
      }
      return {};
    }

    template <class Record>
    runtime::Result<void> record(const Record& recordDraw) const {
      VkCommandBufferBeginInfo begin{};
      begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
      begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
      device_.vk.vkBeginCommandBuffer(commands_, &begin);
      for (const VkImage image : {color_.image, depth_.image}) toGeneral(image);
      if (auto done = recordDraw(commands_, color_.view, depth_.view); !done) return done;
      order(VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_WRITE_BIT, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
            VK_ACCESS_2_TRANSFER_READ_BIT);
      VkBufferImageCopy copy{};
      copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
      copy.imageExtent = {kSoakPictureEdge, kSoakPictureEdge, 1};
      device_.vk.vkCmdCopyImageToBuffer(commands_, color_.image, VK_IMAGE_LAYOUT_GENERAL, readBack_.buffer, 1, &copy);
      order(VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT,
            VK_ACCESS_2_HOST_READ_BIT);
      device_.vk.vkEndCommandBuffer(commands_);
      return {};
    }

    void toGeneral(VkImage image) const {
      VkImageMemoryBarrier2 change{};
      change.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2;
      change.dstStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
      change.dstAccessMask = VK_ACCESS_2_SHADER_WRITE_BIT;
      change.newLayout = VK_IMAGE_LAYOUT_GENERAL;
      change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
      change.image = image;
      change.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
      VkDependencyInfo info{};
      info.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
      info.imageMemoryBarrierCount = 1;
      info.pImageMemoryBarriers = &change;
      device_.vk.vkCmdPipelineBarrier2(commands_, &info);
    }

    void order(VkPipelineStageFlags2 fromStage, VkAccessFlags2 from, VkPipelineStageFlags2 toStage,
               VkAccessFlags2 to) const {
      VkMemoryBarrier2 memory{};
      memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
      memory.srcStageMask = fromStage;
      memory.srcAccessMask = from;
      memory.dstStageMask = toStage;
      memory.dstAccessMask = to;
      VkDependencyInfo info{};
      info.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
      info.memoryBarrierCount = 1;
      info.pMemoryBarriers = &memory;
      device_.vk.vkCmdPipelineBarrier2(commands_, &info);
    }

    const headless::VulkanDevice& device_;
    runtime::UploadWait wait_;
    headless::Target color_, depth_, readBack_;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
  };

  // The renderer outlives the painter.
  Painter(const headless::VulkanDevice& device, runtime::Renderer& renderer) : device_(device), renderer_(renderer) {}

  // By the direct march, whose sums have one order.
  runtime::Result<std::unique_ptr<Pending>> record(std::span<const runtime::Layer> layers,
                                                   const runtime::UploadWait& wait) {
    auto pending = std::make_unique<Pending>(device_, wait);
    if (auto done = pending->make(); !done) return tl::unexpected(done.error());
    runtime::DrawInfo draw;
    draw.layers = layers;
    // Packs of the soak fill a cube of 0.1 units a voxel, from voxel 16 to 80.
    draw.view = runtime::lookAt({7, 6, 20}, {4.8, 4.8, 4.8}, {0, 1, 0}, 36);
    draw.sun = {.direction = {-0.5f, 0.7f, 0.4f}};
    draw.look.extinctionScale = 2;
    draw.quality.shadowSteps = 16;
    draw.width = draw.height = kSoakPictureEdge;
    draw.colorFormat = runtime::ColorFormat::single;
    const auto done = pending->record([&](VkCommandBuffer commands, VkImageView color, VkImageView depth) {
      draw.color = color;
      draw.depth = depth;
      return renderer_.record(commands, draw);
    });
    if (!done) return tl::unexpected(done.error());
    return pending;
  }

 private:
  const headless::VulkanDevice& device_;
  runtime::Renderer& renderer_;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SOAK_PAINTER_H
