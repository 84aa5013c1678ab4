#include "billow/headless/headless.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "billow/headless/target.h"

namespace billow::headless {
namespace {

// What all of a draw's frames are uploaded at.
std::uint64_t uploadValueOf(const runtime::Frame* frame, std::span<const runtime::Layer> layers) {
  std::uint64_t value = frame != nullptr ? frame->uploadValue() : 0;
  for (const runtime::Layer& layer : layers) {
    if (layer.frame != nullptr) value = std::max(value, layer.frame->uploadValue());
  }
  return value;
}

float halfToFloat(std::uint16_t half) {
  const float sign = (half & 0x8000u) != 0 ? -1.0f : 1.0f;
  const int exponent = half >> 10 & 31;
  const int mantissa = half & 1023;
  if (exponent == 31) return mantissa != 0 ? std::nanf("") : sign * std::numeric_limits<float>::infinity();
  if (exponent == 0) return sign * std::ldexp(static_cast<float>(mantissa), -24);
  return sign * std::ldexp(static_cast<float>(mantissa + 1024), exponent - 25);
}

class SceneImageImpl final : public SceneImage {
 public:
  SceneImageImpl(const VulkanDevice& device, std::uint32_t w, std::uint32_t h, std::size_t floats)
      : target(device), width(w), height(h), count(floats) {}
  VkImageView view() const override { return target.view; }

  Target target;
  std::uint32_t width, height;
  std::size_t count;  // floats
};

class HeadlessImpl final : public Headless {
 public:
  ~HeadlessImpl() override {
    if (device_.host.device == VK_NULL_HANDLE) return;
    device_.vk.vkDeviceWaitIdle(device_.host.device);
    if (queries_ != VK_NULL_HANDLE) device_.vk.vkDestroyQueryPool(device_.host.device, queries_, nullptr);
    if (pool_ != VK_NULL_HANDLE) device_.vk.vkDestroyCommandPool(device_.host.device, pool_, nullptr);
  }

  Result<void> open(const DeviceOptions& options) {
    if (auto done = device_.open(options); !done) return done;
    auto poolInfo = begin<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    poolInfo.queueFamilyIndex = device_.host.drawFamily;
    auto queryInfo = begin<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
    queryInfo.queryType = VK_QUERY_TYPE_TIMESTAMP;
    queryInfo.queryCount = runtime::kMetavoxelTimestamps;
    const VkDevice device = device_.host.device;
    if (device_.vk.vkCreateCommandPool(device, &poolInfo, nullptr, &pool_) != VK_SUCCESS ||
        device_.vk.vkCreateQueryPool(device, &queryInfo, nullptr, &queries_) != VK_SUCCESS) {
      return gpuError("a command pool or query pool cannot be made");
    }
    auto info = begin<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    info.commandPool = pool_;
    info.commandBufferCount = 1;
    if (device_.vk.vkAllocateCommandBuffers(device, &info, &commands_) != VK_SUCCESS) {
      return gpuError("vkAllocateCommandBuffers failed");
    }
    return {};
  }

  const runtime::HostDevice& host() const override { return device_.host; }
  const std::string& deviceName() const override { return device_.name; }
  const VulkanDevice& device() const override { return device_; }
  const std::vector<std::string>& validationMessages() const override { return device_.messages; }
  void waitIdle() override { device_.vk.vkDeviceWaitIdle(device_.host.device); }

  Result<Picture> render(runtime::Renderer& renderer, runtime::DrawInfo draw) override {
    return drawPicture(renderer, draw, uploadValueOf(draw.frame, draw.layers),
                       [&] { return renderer.record(commands_, draw); });
  }

  Result<Picture> render(runtime::Renderer& renderer, runtime::Metavoxels& metavoxels, runtime::MetavoxelDraw draw,
                         std::span<const float> sceneDepth) override {
    std::unique_ptr<SceneImage> scene;
    if (!sceneDepth.empty()) {
      auto made = sceneImage(draw.width, draw.height, sceneDepth);
      if (!made) return tl::unexpected(made.error());
      scene = std::move(*made);
      draw.sceneDepth = scene->view();
    }
    return drawPicture(renderer, draw, uploadOf(draw), [&] { return metavoxels.record(commands_, draw); });
  }

  Result<std::unique_ptr<SceneImage>> sceneImage(std::uint32_t width, std::uint32_t height,
                                                 std::span<const float> texels) override {
    auto made = std::make_unique<SceneImageImpl>(device_, width, height, texels.size());
    const bool single = texels.size() == std::size_t{width} * height;
    const VkFormat format = single ? VK_FORMAT_R32_SFLOAT : VK_FORMAT_R32G32B32A32_SFLOAT;
    Target staging(device_);
    if (auto done = staging.makeBuffer(texels.size_bytes(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT); !done) {
      return tl::unexpected(done.error());
    }
    if (auto done = made->target.makeImage(format, width, height); !done) {
      return tl::unexpected(done.error());
    }
    std::memcpy(staging.mapped, texels.data(), texels.size_bytes());
    beginCommands();
    fillImage(made->target.image, width, height, staging.buffer);
    if (auto done = submitAndWait(VK_NULL_HANDLE, 0); !done) return tl::unexpected(done.error());
    return std::unique_ptr<SceneImage>(std::move(made));
  }

  Result<std::vector<float>> read(const SceneImage& image) override {
    const auto& from = static_cast<const SceneImageImpl&>(image);
    Target out(device_);
    if (auto done = out.makeBuffer(from.count * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT); !done) {
      return tl::unexpected(done.error());
    }
    const auto copy = [&](VkCommandBuffer) -> Result<void> {
      copyImage(from.target.image, from.width, from.height, out.buffer, 0);
      barrier(VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT,
              VK_ACCESS_2_HOST_READ_BIT);
      return {};
    };
    if (auto done = run(copy); !done) return tl::unexpected(done.error());
    return std::vector<float>(out.mapped, out.mapped + from.count);
  }

  Result<void> run(const std::function<Result<void>(VkCommandBuffer)>& record) override {
    beginCommands();
    if (auto done = record(commands_); !done) return done;
    return submitAndWait(VK_NULL_HANDLE, 0);
  }

  Result<std::vector<float>> readShadow(runtime::Renderer& renderer, const runtime::Metavoxels& metavoxels) override {
    const runtime::MetavoxelShadow shadow = metavoxels.shadow();
    const std::size_t texels = std::size_t{shadow.size} * shadow.size;
    Target out(device_);
    if (auto done = out.makeBuffer(texels * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT); !done) {
      return tl::unexpected(done.error());
    }
    beginCommands();
    copyImage(shadow.image, shadow.size, shadow.size, out.buffer, 0);
    barrier(VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT,
            VK_ACCESS_2_HOST_READ_BIT);
    if (auto done = submitAndWait(renderer.uploadSemaphore(), 0); !done) return tl::unexpected(done.error());
    return std::vector<float>(out.mapped, out.mapped + texels);
  }

  Result<std::vector<format::Particle>> readParticles(runtime::Renderer& renderer,
                                                      const runtime::Metavoxels& metavoxels) override {
    const runtime::MetavoxelParticles particles = metavoxels.particles();
    std::vector<format::Particle> all(particles.count);
    if (all.empty()) return all;
    const VkDeviceSize bytes = all.size() * sizeof(format::Particle);
    Target out(device_);
    if (auto done = out.makeBuffer(bytes, VK_BUFFER_USAGE_TRANSFER_DST_BIT); !done) return tl::unexpected(done.error());
    beginCommands();
    const VkBufferCopy copy{particles.offset, 0, bytes};
    device_.vk.vkCmdCopyBuffer(commands_, particles.buffer, out.buffer, 1, &copy);
    barrier(VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT,
            VK_ACCESS_2_HOST_READ_BIT);
    if (auto done = submitAndWait(renderer.uploadSemaphore(), 0); !done) return tl::unexpected(done.error());
    std::memcpy(all.data(), out.mapped, bytes);
    for (format::Particle& particle : all) {
      for (std::size_t i = 0; i < 3; ++i) {
        particle.center[i] = static_cast<float>(double{particle.center[i]} + particles.center[i]);
      }
    }
    return all;
  }

  Result<std::vector<double>> time(runtime::Renderer& renderer, runtime::DrawInfo draw, std::uint32_t count) override {
    std::vector<double> milliseconds;
    const auto record = [&]() -> Result<void> {
      stamp(0);
      if (auto done = renderer.record(commands_, draw); !done) return done;
      stamp(1);
      return {};
    };
    const auto take = [&] { milliseconds.push_back(passTimes(2)[0]); };
    if (auto done = drawTimed(renderer, draw, uploadValueOf(draw.frame, draw.layers), count, record, take); !done) {
      return tl::unexpected(done.error());
    }
    return milliseconds;
  }

  Result<std::vector<PassTimes>> time(runtime::Renderer& renderer, runtime::Metavoxels& metavoxels,
                                      runtime::MetavoxelDraw draw, std::uint32_t count) override {
    std::vector<PassTimes> rows;
    draw.timestamps = queries_;
    const auto record = [&] { return metavoxels.record(commands_, draw); };
    const auto take = [&] { rows.push_back(passTimes(runtime::kMetavoxelTimestamps)); };
    if (auto done = drawTimed(renderer, draw, uploadOf(draw), count, record, take); !done) {
      return tl::unexpected(done.error());
    }
    return rows;
  }

  Result<std::vector<float>> lookup(runtime::Renderer& renderer, const runtime::Frame& frame, std::uint32_t slot,
                                    runtime::Filter filter, const std::vector<float>& positions) override {
    const std::size_t count = positions.size() / 3;
    const VkBufferUsageFlags usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
    Target in(device_), out(device_);
    if (auto done = in.makeBuffer(positions.size() * 4, usage); !done) return tl::unexpected(done.error());
    if (auto done = out.makeBuffer(count * 4, usage); !done) return tl::unexpected(done.error());
    std::memcpy(in.mapped, positions.data(), positions.size() * 4);
    beginCommands();
    const runtime::LookupInfo info{.frame = &frame,
                                   .slot = slot,
                                   .filter = filter,
                                   .positions = in.address(),
                                   .values = out.address(),
                                   .count = static_cast<std::uint32_t>(count)};
    if (auto done = renderer.recordLookup(commands_, info); !done) return tl::unexpected(done.error());
    barrier(VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT,
            VK_ACCESS_2_HOST_READ_BIT);
    if (auto done = submitAndWait(renderer.uploadSemaphore(), frame.uploadValue()); !done)
      return tl::unexpected(done.error());
    return std::vector<float>(out.mapped, out.mapped + count);
  }

 private:
  static std::uint64_t uploadOf(const runtime::MetavoxelDraw& draw) {
    std::uint64_t value = 0;
    for (const runtime::MetavoxelVolume& volume : draw.volumes) {
      value = std::max(value, uploadValueOf(volume.frame, volume.layers));
    }
    return value;
  }

  // Draws into images of the size and format that `draw` (DrawInfo or MetavoxelDraw) names; they are filled in.
  template <class Draw, class Record>
  Result<Picture> drawPicture(runtime::Renderer& renderer, Draw& draw, std::uint64_t uploadValue,
                              const Record& record) {
    const std::size_t pixels = std::size_t{draw.width} * draw.height;
    Target color(device_), depth(device_), readBack(device_);
    if (auto done = makeImages(draw, color, depth); !done) return tl::unexpected(done.error());
    if (auto done = readBack.makeBuffer(pixels * 20, VK_BUFFER_USAGE_TRANSFER_DST_BIT); !done) {
      return tl::unexpected(done.error());
    }
    beginCommands();
    toGeneral(color.image, depth.image);
    if (auto done = record(); !done) return tl::unexpected(done.error());
    barrier(VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_WRITE_BIT, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
            VK_ACCESS_2_TRANSFER_READ_BIT);
    copyImage(color.image, draw.width, draw.height, readBack.buffer, 0);
    copyImage(depth.image, draw.width, draw.height, readBack.buffer, pixels * 16);
    barrier(VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT, VK_PIPELINE_STAGE_2_HOST_BIT,
            VK_ACCESS_2_HOST_READ_BIT);
    if (auto done = submitAndWait(renderer.uploadSemaphore(), uploadValue); !done) return tl::unexpected(done.error());
    Picture picture{.width = draw.width, .height = draw.height, .rgba = {}, .depth = {}};
    if (draw.colorFormat == runtime::ColorFormat::half) {
      std::vector<std::uint16_t> halves(pixels * 4);
      std::memcpy(halves.data(), readBack.mapped, halves.size() * 2);
      for (const std::uint16_t half : halves) picture.rgba.push_back(halfToFloat(half));
    } else {
      picture.rgba.assign(readBack.mapped, readBack.mapped + pixels * 4);
    }
    picture.depth.assign(readBack.mapped + pixels * 4, readBack.mapped + pixels * 5);
    return picture;
  }

  // Draws `count` times; `record` writes the timestamps and `take` reads them.
  template <class Draw, class Record, class Take>
  Result<void> drawTimed(runtime::Renderer& renderer, Draw& draw, std::uint64_t uploadValue, std::uint32_t count,
                         const Record& record, const Take& take) {
    Target color(device_), depth(device_);
    if (auto done = makeImages(draw, color, depth); !done) return done;
    for (std::uint32_t i = 0; i < count; ++i) {
      beginCommands();
      toGeneral(color.image, depth.image);
      device_.vk.vkCmdResetQueryPool(commands_, queries_, 0, runtime::kMetavoxelTimestamps);
      if (auto done = record(); !done) return done;
      if (auto done = submitAndWait(renderer.uploadSemaphore(), uploadValue); !done) return done;
      take();
    }
    return {};
  }

  void stamp(std::uint32_t query) {
    device_.vk.vkCmdWriteTimestamp2(commands_, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, queries_, query);
  }

  // Milliseconds between the first `count` timestamps.
  PassTimes passTimes(std::uint32_t count) {
    std::array<std::uint64_t, runtime::kMetavoxelTimestamps> ticks{};
    device_.vk.vkGetQueryPoolResults(device_.host.device, queries_, 0, count, sizeof(ticks), ticks.data(),
                                     sizeof(ticks[0]), VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT);
    PassTimes times{};
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
      times[i] = static_cast<double>(ticks[i + 1] - ticks[i]) * double{device_.timestampPeriod} * 1e-6;
    }
    return times;
  }

  template <class Draw>
  Result<void> makeImages(Draw& draw, Target& color, Target& depth) {
    const bool half = draw.colorFormat == runtime::ColorFormat::half;
    const VkFormat format = half ? VK_FORMAT_R16G16B16A16_SFLOAT : VK_FORMAT_R32G32B32A32_SFLOAT;
    if (auto done = color.makeImage(format, draw.width, draw.height); !done) return done;
    if (auto done = depth.makeImage(VK_FORMAT_R32_SFLOAT, draw.width, draw.height); !done) return done;
    draw.color = color.view;
    draw.depth = depth.view;
    return {};
  }

  void beginCommands() {
    device_.vk.vkResetCommandPool(device_.host.device, pool_, 0);
    auto info = begin<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
    info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    device_.vk.vkBeginCommandBuffer(commands_, &info);
  }

  void toGeneral(VkImage color, VkImage depth) {
    for (const VkImage image : {color, depth}) {
      // The compute stage orders this draw after the one before it, which wrote the same images.
      toGeneral(image, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_WRITE_BIT);
    }
  }

  // What the image held is lost; the next access is by this stage.
  void toGeneral(VkImage image, VkPipelineStageFlags2 stage, VkAccessFlags2 access) {
    auto change = begin<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
    change.srcStageMask = change.dstStageMask = stage;
    change.dstAccessMask = access;
    change.newLayout = VK_IMAGE_LAYOUT_GENERAL;
    change.srcQueueFamilyIndex = change.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    change.image = image;
    change.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    auto info = begin<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
    info.imageMemoryBarrierCount = 1;
    info.pImageMemoryBarriers = &change;
    device_.vk.vkCmdPipelineBarrier2(commands_, &info);
  }

  void fillImage(VkImage image, std::uint32_t width, std::uint32_t height, VkBuffer from) {
    toGeneral(image, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT);
    VkBufferImageCopy copy{};
    copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    copy.imageExtent = {width, height, 1};
    device_.vk.vkCmdCopyBufferToImage(commands_, from, image, VK_IMAGE_LAYOUT_GENERAL, 1, &copy);
    barrier(VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
            VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_READ_BIT);
  }

  void barrier(VkPipelineStageFlags2 fromStage, VkAccessFlags2 fromAccess, VkPipelineStageFlags2 toStage,
               VkAccessFlags2 toAccess) {
    auto memory = begin<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
    memory.srcStageMask = fromStage;
    memory.srcAccessMask = fromAccess;
    memory.dstStageMask = toStage;
    memory.dstAccessMask = toAccess;
    auto info = begin<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
    info.memoryBarrierCount = 1;
    info.pMemoryBarriers = &memory;
    device_.vk.vkCmdPipelineBarrier2(commands_, &info);
  }

  void copyImage(VkImage image, std::uint32_t width, std::uint32_t height, VkBuffer to, VkDeviceSize offset) {
    VkBufferImageCopy copy{};
    copy.bufferOffset = offset;
    copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    copy.imageExtent = {width, height, 1};
    device_.vk.vkCmdCopyImageToBuffer(commands_, image, VK_IMAGE_LAYOUT_GENERAL, to, 1, &copy);
  }

  // After the semaphore has reached the value, where there is one.
  Result<void> submitAndWait(VkSemaphore semaphore, std::uint64_t value) {
    device_.vk.vkEndCommandBuffer(commands_);
    auto commandInfo = begin<VkCommandBufferSubmitInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_SUBMIT_INFO);
    commandInfo.commandBuffer = commands_;
    auto wait = begin<VkSemaphoreSubmitInfo>(VK_STRUCTURE_TYPE_SEMAPHORE_SUBMIT_INFO);
    wait.semaphore = semaphore;
    wait.value = value;
    wait.stageMask = VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT;
    auto info = begin<VkSubmitInfo2>(VK_STRUCTURE_TYPE_SUBMIT_INFO_2);
    info.waitSemaphoreInfoCount = semaphore != VK_NULL_HANDLE ? 1 : 0;
    info.pWaitSemaphoreInfos = &wait;
    info.commandBufferInfoCount = 1;
    info.pCommandBufferInfos = &commandInfo;
    VkResult result = device_.vk.vkQueueSubmit2(device_.host.uploadQueue, 1, &info, VK_NULL_HANDLE);
    // Not a fence: Mesa's software queue still touches the timeline semaphore after it has signalled one, so whoever
    // destroyed the renderer at once would pull it from under the queue's thread.
    if (result == VK_SUCCESS) result = device_.vk.vkQueueWaitIdle(device_.host.uploadQueue);
    if (result != VK_SUCCESS) return gpuError("the GPU failed with VkResult " + std::to_string(result));
    return {};
  }

  VulkanDevice device_;
  VkCommandPool pool_ = VK_NULL_HANDLE;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  VkQueryPool queries_ = VK_NULL_HANDLE;
};

}  // namespace

Result<std::unique_ptr<Headless>> Headless::create(const DeviceOptions& options) {
  auto headless = std::make_unique<HeadlessImpl>();
  if (auto done = headless->open(options); !done) return tl::unexpected(done.error());
  return std::unique_ptr<Headless>(std::move(headless));
}

}  // namespace billow::headless
