#include "billow/runtime/composite.h"

#include <array>
#include <span>
#include <vector>

#include "checks.h"
#include "compute_pipeline.h"
#include "debug.h"
#include "spirv.h"

namespace billow::runtime {
namespace {

// Bindings and push constants of shaders/composite.comp.
enum Binding : std::uint32_t { color, depth, sceneDepth, target, targetDepth, kBindings };

struct Push {
  std::uint32_t size[2];
  std::uint32_t targetSize[2];
  std::uint32_t marchedToScene;
};

// By the formats of picture and target.
std::span<const std::uint32_t> codeOf(ColorFormat picture, ColorFormat target) {
  const bool half = target == ColorFormat::half;
  if (picture == ColorFormat::half) {
    return half ? std::span<const std::uint32_t>(spirv::kCompositeHalfHalf) : spirv::kCompositeHalfSingle;
  }
  return half ? std::span<const std::uint32_t>(spirv::kCompositeSingleHalf) : spirv::kCompositeSingleSingle;
}

const char* badDraw(const CompositeDraw& draw) {
  if (draw.width == 0 || draw.height == 0) return "width, height";
  if (draw.targetWidth == 0 || draw.targetHeight == 0) return "targetWidth, targetHeight";
  if (draw.color == VK_NULL_HANDLE || draw.depth == VK_NULL_HANDLE) return "color, depth";
  return draw.target == VK_NULL_HANDLE || draw.targetDepth == VK_NULL_HANDLE ? "target, targetDepth" : nullptr;
}

class CompositorImpl final : public Compositor {
 public:
  CompositorImpl(Device& device, std::uint32_t inFlight) : device_(device), sets_(inFlight) {}
  CompositorImpl(const CompositorImpl&) = delete;
  CompositorImpl& operator=(const CompositorImpl&) = delete;
  ~CompositorImpl() override {
    const VkDevice device = device_.host.device;
    for (const VkPipeline pipeline : pipelines_) {
      if (pipeline != VK_NULL_HANDLE) device_.api.vkDestroyPipeline(device, pipeline, device_.host.allocationCallbacks);
    }
    if (pool_ != VK_NULL_HANDLE) device_.api.vkDestroyDescriptorPool(device, pool_, device_.host.allocationCallbacks);
    if (layout_ != VK_NULL_HANDLE)
      device_.api.vkDestroyPipelineLayout(device, layout_, device_.host.allocationCallbacks);
    if (setLayout_ != VK_NULL_HANDLE)
      device_.api.vkDestroyDescriptorSetLayout(device, setLayout_, device_.host.allocationCallbacks);
  }

  Result<void> initialise() {
    if (auto made = createLayouts(); !made) return made;
    return createSets();
  }

  Result<void> record(VkCommandBuffer commands, const CompositeDraw& draw) override {
    return guarded<void>([&]() -> Result<void> {
      if (const char* field = badDraw(draw)) {
        return failure(ErrorCode::argument, std::string("CompositeDraw: ") + field + " is outside of its range");
      }
      auto made = pipeline(draw.colorFormat, draw.targetFormat);
      if (!made) return tl::unexpected(made.error());
      const VkDescriptorSet set = sets_[next_];
      next_ = (next_ + 1) % static_cast<std::uint32_t>(sets_.size());
      write(set, draw);
      const Push push{.size = {draw.width, draw.height},
                      .targetSize = {draw.targetWidth, draw.targetHeight},
                      .marchedToScene = draw.sceneDepth != VK_NULL_HANDLE ? 1u : 0u};
      const auto& api = device_.api;
      const DebugLabel label(api, commands, "billow composite");
      api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, *made);
      api.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &set, 0, nullptr);
      api.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push), &push);
      api.vkCmdDispatch(commands, (draw.targetWidth + 7) / 8, (draw.targetHeight + 7) / 8, 1);
      return {};
    });
  }

 private:
  Result<void> createLayouts() {
    std::array<VkDescriptorSetLayoutBinding, kBindings> bindings{};
    for (std::uint32_t i = 0; i < kBindings; ++i) {
      bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
    }
    auto setInfo = begin<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    setInfo.bindingCount = kBindings;
    setInfo.pBindings = bindings.data();
    VkResult result = device_.api.vkCreateDescriptorSetLayout(device_.host.device, &setInfo,
                                                              device_.host.allocationCallbacks, &setLayout_);
    if (result != VK_SUCCESS) return vulkanError("vkCreateDescriptorSetLayout", result);
    const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(Push)};
    auto info = begin<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    info.setLayoutCount = 1;
    info.pSetLayouts = &setLayout_;
    info.pushConstantRangeCount = 1;
    info.pPushConstantRanges = &range;
    result = device_.api.vkCreatePipelineLayout(device_.host.device, &info, device_.host.allocationCallbacks, &layout_);
    if (result != VK_SUCCESS) return vulkanError("vkCreatePipelineLayout", result);
    return {};
  }

  Result<void> createSets() {
    const auto count = static_cast<std::uint32_t>(sets_.size());
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, kBindings * count};
    auto poolInfo = begin<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    poolInfo.maxSets = count;
    poolInfo.poolSizeCount = 1;
    poolInfo.pPoolSizes = &size;
    VkResult result =
        device_.api.vkCreateDescriptorPool(device_.host.device, &poolInfo, device_.host.allocationCallbacks, &pool_);
    if (result != VK_SUCCESS) return vulkanError("vkCreateDescriptorPool", result);
    const std::vector<VkDescriptorSetLayout> layouts(count, setLayout_);
    auto info = begin<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    info.descriptorPool = pool_;
    info.descriptorSetCount = count;
    info.pSetLayouts = layouts.data();
    result = device_.api.vkAllocateDescriptorSets(device_.host.device, &info, sets_.data());
    if (result != VK_SUCCESS) return vulkanError("vkAllocateDescriptorSets", result);
    return {};
  }

  Result<VkPipeline> pipeline(ColorFormat picture, ColorFormat targetFormat) {
    VkPipeline& place = pipelines_[static_cast<std::size_t>(picture) * 2 + static_cast<std::size_t>(targetFormat)];
    if (place != VK_NULL_HANDLE) return place;
    auto made = makeComputePipeline(device_, "billow composite", layout_, codeOf(picture, targetFormat), {});
    if (made) place = *made;
    return made;
  }

  void write(VkDescriptorSet set, const CompositeDraw& draw) {
    // Where there is no scene of the picture's, any image of its kind is bound, and not read.
    const VkImageView scene = draw.sceneDepth != VK_NULL_HANDLE ? draw.sceneDepth : draw.depth;
    const VkImageView views[kBindings] = {draw.color, draw.depth, scene, draw.target, draw.targetDepth};
    VkDescriptorImageInfo images[kBindings];
    VkWriteDescriptorSet writes[kBindings];
    for (std::uint32_t i = 0; i < kBindings; ++i) {
      images[i] = {VK_NULL_HANDLE, views[i], VK_IMAGE_LAYOUT_GENERAL};
      writes[i] = begin<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
      writes[i].dstSet = set;
      writes[i].dstBinding = i;
      writes[i].descriptorCount = 1;
      writes[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
      writes[i].pImageInfo = &images[i];
    }
    device_.api.vkUpdateDescriptorSets(device_.host.device, kBindings, writes, 0, nullptr);
  }

  Device& device_;
  std::vector<VkDescriptorSet> sets_;  // one a record in flight
  std::uint32_t next_ = 0;
  VkDescriptorSetLayout setLayout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  std::array<VkPipeline, 4> pipelines_{};
};

}  // namespace

Result<std::unique_ptr<Compositor>> Compositor::create(Renderer& renderer, std::uint32_t recordsInFlight) {
  if (recordsInFlight == 0) return failure(ErrorCode::argument, "Compositor: recordsInFlight is 0");
  Device& device = renderer.device();
  return guarded<std::unique_ptr<Compositor>>([&]() -> Result<std::unique_ptr<Compositor>> {
    auto compositor = std::make_unique<CompositorImpl>(device, recordsInFlight);
    if (auto ready = compositor->initialise(); !ready) return tl::unexpected(ready.error());
    return std::unique_ptr<Compositor>(std::move(compositor));
  });
}

}  // namespace billow::runtime
