// A game's frame loop without a window: several frames in flight, each submission waiting for the uploads that it
// draws.
#ifndef BILLOW_TESTS_DRAW_LOOP_H
#define BILLOW_TESTS_DRAW_LOOP_H

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "billow/headless/headless.h"
#include "billow/runtime/stream.h"

namespace billow::tests {

#define BILLOW_LOOP_FUNCTIONS(X) \
  X(vkAllocateCommandBuffers)    \
  X(vkBeginCommandBuffer)        \
  X(vkCmdPipelineBarrier2)       \
  X(vkCreateCommandPool)         \
  X(vkCreateSemaphore)           \
  X(vkDestroyCommandPool)        \
  X(vkDestroySemaphore)          \
  X(vkEndCommandBuffer)          \
  X(vkGetSemaphoreCounterValue)  \
  X(vkQueueSubmit2)              \
  X(vkQueueWaitIdle)             \
  X(vkResetCommandPool)          \
  X(vkWaitSemaphores)

// One image that is drawn into over and over; nobody looks at it.
class DrawLoop {
 public:
  static runtime::Result<std::unique_ptr<DrawLoop>> create(headless::Headless& gpu, std::uint32_t width,
                                                           std::uint32_t height, std::uint32_t framesInFlight) {
    std::unique_ptr<DrawLoop> loop(new DrawLoop(gpu.host(), width, height));
    const std::vector<float> color(std::size_t{width} * height * 4), depth(std::size_t{width} * height);
    for (auto& [image, texels] : {std::pair{&loop->color_, &color}, std::pair{&loop->depth_, &depth}}) {
      auto made = gpu.sceneImage(width, height, *texels);
      if (!made) return tl::unexpected(made.error());
      *image = std::move(*made);
    }
    if (auto done = loop->makeObjects(framesInFlight); !done) return tl::unexpected(done.error());
    return loop;
  }
  DrawLoop(const DrawLoop&) = delete;
  DrawLoop& operator=(const DrawLoop&) = delete;
  ~DrawLoop() {
    vkQueueWaitIdle(host_.uploadQueue);
    for (const Slot& slot : slots_) vkDestroyCommandPool(host_.device, slot.pool, nullptr);
    vkDestroySemaphore(host_.device, done_, nullptr);
  }

  // Waits until the commands of framesInFlight draws ago have been executed: what a game does before its update().
  runtime::Result<void> begin() { return wait(done_, drawn_ < slots_.size() ? 0 : drawn_ + 1 - slots_.size()); }

  // Fills in where `draw` draws to, records it and submits it behind `uploads`.
  runtime::Result<void> draw(runtime::Metavoxels& metavoxels, runtime::MetavoxelDraw draw,
                             const runtime::UploadWait& uploads) {
    draw.width = width_;
    draw.height = height_;
    draw.colorFormat = runtime::ColorFormat::single;
    draw.color = color_->view();
    draw.depth = depth_->view();
    const Slot& slot = slots_[drawn_ % slots_.size()];
    vkResetCommandPool(host_.device, slot.pool, 0);
    auto info = VkCommandBufferBeginInfo{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    vkBeginCommandBuffer(slot.commands, &info);
    orderDraws(slot.commands);
    if (auto done = metavoxels.record(slot.commands, draw); !done) return done;
    vkEndCommandBuffer(slot.commands);
    return submit(slot.commands, uploads);
  }

  // Waits on the CPU; an error after ten seconds, for what the streamer promises comes.
  runtime::Result<void> wait(VkSemaphore semaphore, std::uint64_t value) const {
    if (semaphore == VK_NULL_HANDLE || value == 0) return {};
    VkSemaphoreWaitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO;
    info.semaphoreCount = 1;
    info.pSemaphores = &semaphore;
    info.pValues = &value;
    const VkResult result = vkWaitSemaphores(host_.device, &info, 10'000'000'000u);
    if (result != VK_SUCCESS) return failed("a semaphore is not reached", result);
    return {};
  }

  std::uint64_t drawn() const { return drawn_; }
  // Draws that were submitted before their uploads were complete: the device waited, not the host.
  std::uint64_t waited() const { return waited_; }

 private:
  struct Slot {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
  };

  DrawLoop(const runtime::HostDevice& host, std::uint32_t width, std::uint32_t height)
      : host_(host), width_(width), height_(height) {
    const auto load =
        reinterpret_cast<PFN_vkGetDeviceProcAddr>(host.getInstanceProcAddr(host.instance, "vkGetDeviceProcAddr"));
#define BILLOW_LOAD(name) name = reinterpret_cast<PFN_##name>(load(host.device, #name));
    BILLOW_LOOP_FUNCTIONS(BILLOW_LOAD)
#undef BILLOW_LOAD
  }

  static tl::unexpected<runtime::Error> failed(const char* what, VkResult result) {
    return tl::unexpected(runtime::Error{.code = runtime::ErrorCode::vulkan,
                                         .message = std::string(what) + ": VkResult " + std::to_string(result)});
  }

  runtime::Result<void> makeObjects(std::uint32_t framesInFlight) {
    VkSemaphoreTypeCreateInfo type{};
    type.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO;
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    VkSemaphoreCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    info.pNext = &type;
    VkResult result = vkCreateSemaphore(host_.device, &info, nullptr, &done_);
    for (std::uint32_t i = 0; i < framesInFlight && result == VK_SUCCESS; ++i) {
      Slot& slot = slots_.emplace_back();
      VkCommandPoolCreateInfo pool{};
      pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
      pool.queueFamilyIndex = host_.drawFamily;
      result = vkCreateCommandPool(host_.device, &pool, nullptr, &slot.pool);
      if (result != VK_SUCCESS) break;
      VkCommandBufferAllocateInfo commands{};
      commands.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
      commands.commandPool = slot.pool;
      commands.commandBufferCount = 1;
      result = vkAllocateCommandBuffers(host_.device, &commands, &slot.commands);
    }
    if (result != VK_SUCCESS) return failed("the loop's objects", result);
    return {};
  }

  // Each draw writes the images that the one before wrote.
  void orderDraws(VkCommandBuffer commands) const {
    VkMemoryBarrier2 memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER_2;
    memory.srcStageMask = memory.dstStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
    memory.srcAccessMask = memory.dstAccessMask = VK_ACCESS_2_SHADER_WRITE_BIT;
    VkDependencyInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEPENDENCY_INFO;
    info.memoryBarrierCount = 1;
    info.pMemoryBarriers = &memory;
    vkCmdPipelineBarrier2(commands, &info);
  }

  runtime::Result<void> submit(VkCommandBuffer commands, const runtime::UploadWait& uploads) {
    VkSemaphoreSubmitInfo wait{}, signal{};
    wait.sType = signal.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO;
    wait.semaphore = uploads.semaphore;
    wait.value = uploads.value;
    signal.semaphore = done_;
    signal.value = drawn_ + 1;
    wait.stageMask = signal.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    VkCommandBufferSubmitInfo buffer{};
    buffer.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO;
    buffer.commandBuffer = commands;
    VkSubmitInfo2 info{};
    info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO_2;
    info.waitSemaphoreInfoCount = uploads.semaphore != VK_NULL_HANDLE ? 1 : 0;
    info.pWaitSemaphoreInfos = &wait;
    info.commandBufferInfoCount = info.signalSemaphoreInfoCount = 1;
    info.pCommandBufferInfos = &buffer;
    info.pSignalSemaphoreInfos = &signal;
    std::uint64_t reached = uploads.value;
    if (uploads.semaphore != VK_NULL_HANDLE) {
      vkGetSemaphoreCounterValue(host_.device, uploads.semaphore, &reached);
    }
    waited_ += reached < uploads.value ? 1 : 0;
    const VkResult result = vkQueueSubmit2(host_.uploadQueue, 1, &info, VK_NULL_HANDLE);
    if (result != VK_SUCCESS) return failed("vkQueueSubmit2", result);
    ++drawn_;
    return {};
  }

  runtime::HostDevice host_;
  std::uint32_t width_, height_;
  std::unique_ptr<headless::SceneImage> color_, depth_;
  std::vector<Slot> slots_;
  VkSemaphore done_ = VK_NULL_HANDLE;  // reaches the number of draws that were executed
  std::uint64_t drawn_ = 0, waited_ = 0;
#define BILLOW_DECLARE(name) PFN_##name name = nullptr;
  BILLOW_LOOP_FUNCTIONS(BILLOW_DECLARE)
#undef BILLOW_DECLARE
};

#undef BILLOW_LOOP_FUNCTIONS

}  // namespace billow::tests

#endif  // BILLOW_TESTS_DRAW_LOOP_H
