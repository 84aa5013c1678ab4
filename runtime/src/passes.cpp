#include "passes.h"

#include <array>
#include <cstring>
#include <span>

#include "compute_pipeline.h"
#include "params.h"
#include "spirv.h"

namespace billow::runtime {
namespace {

// At least as large as any device's uniform buffer alignment.
constexpr std::uint64_t kParamsStride = (sizeof(LayeredParams) + 255) / 256 * 256;
constexpr std::uint32_t kPushBytes = 24;  // voxels.comp
constexpr std::uint32_t kColorBinding = 2, kDepthBinding = 3;
constexpr std::uint32_t kBindings = 7;  // and atlases: of the first layer 1, of others 4 to 6

VkDescriptorType bindingType(std::uint32_t binding) {
  if (binding == 0) return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
  const bool picture = binding == kColorBinding || binding == kDepthBinding;
  return picture ? VK_DESCRIPTOR_TYPE_STORAGE_IMAGE : VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
}

// In the order of Shader.
std::span<const std::uint32_t> spirvOf(Shader shader) {
  static const std::span<const std::uint32_t> codes[] = {
      spirv::kMarchHalf, spirv::kMarchSingle, spirv::kMarchLayersHalf, spirv::kMarchLayersSingle, spirv::kVoxels};
  return codes[static_cast<std::size_t>(shader)];
}

void addGrids(const FrameIndices& indices, PassKey& key) {
  for (std::uint32_t slot = 0; slot < gpu::kGridSlots; ++slot) {
    if (!indices[slot]) continue;
    const std::uint32_t index = static_cast<std::uint32_t>(*indices[slot]);
    key.index = key.grids == 0 || key.index == index ? index : gpu::kIndexMixed;
    key.grids |= 1u << slot;
  }
}

}  // namespace

PassKey passKey(const FrameIndices& indices, Shader shader, Filter filter, Filter shadow) {
  PassKey key{.shader = shader,
              .index = gpu::kIndexMixed,
              .filter = static_cast<std::uint32_t>(filter),
              .shadow = static_cast<std::uint32_t>(shadow),
              .grids = 0};
  addGrids(indices, key);
  return key;
}

PassKey passKey(std::span<const Layer> layers, Shader shader, Filter filter, Filter shadow) {
  PassKey key = passKey(FrameIndices{}, shader, filter, shadow);
  for (const Layer& layer : layers) addGrids(matterOf(frameOf(layer).indices()), key);
  key.layers = static_cast<std::uint32_t>(layers.size());
  return key;
}

Passes::~Passes() {
  const VkDevice device = device_.host.device;
  for (const auto& [key, pipeline] : pipelines_)
    device_.api.vkDestroyPipeline(device, pipeline, device_.host.allocationCallbacks);
  if (pool_ != VK_NULL_HANDLE) device_.api.vkDestroyDescriptorPool(device, pool_, device_.host.allocationCallbacks);
  if (pipelineLayout_ != VK_NULL_HANDLE)
    device_.api.vkDestroyPipelineLayout(device, pipelineLayout_, device_.host.allocationCallbacks);
  if (setLayout_ != VK_NULL_HANDLE)
    device_.api.vkDestroyDescriptorSetLayout(device, setLayout_, device_.host.allocationCallbacks);
}

Result<void> Passes::create() {
  if (auto made = createLayouts(); !made) return made;
  if (auto made = createSets(); !made) return made;
  auto params =
      Buffer::make(device_, "billow march parameters", kParamsStride * inFlight_, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT);
  if (!params) return tl::unexpected(params.error());
  params_ = std::move(*params);
  return params_.bind(Placement::mapped);
}

Result<void> Passes::createLayouts() {
  std::array<VkDescriptorSetLayoutBinding, kBindings> bindings{};
  for (std::uint32_t i = 0; i < kBindings; ++i) {
    bindings[i] = {i, bindingType(i), 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  }
  auto setInfo = begin<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  setInfo.bindingCount = kBindings;
  setInfo.pBindings = bindings.data();
  VkResult result = device_.api.vkCreateDescriptorSetLayout(device_.host.device, &setInfo,
                                                            device_.host.allocationCallbacks, &setLayout_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateDescriptorSetLayout", result);
  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, kPushBytes};
  auto info = begin<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.setLayoutCount = 1;
  info.pSetLayouts = &setLayout_;
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &push;
  result = device_.api.vkCreatePipelineLayout(device_.host.device, &info, device_.host.allocationCallbacks,
                                              &pipelineLayout_);
  if (result != VK_SUCCESS) return vulkanError("vkCreatePipelineLayout", result);
  return {};
}

Result<void> Passes::createSets() {
  const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, inFlight_},
                                        {VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, (kBindings - 3) * inFlight_},
                                        {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 2 * inFlight_}};
  auto poolInfo = begin<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  poolInfo.maxSets = inFlight_;
  poolInfo.poolSizeCount = 3;
  poolInfo.pPoolSizes = sizes;
  VkResult result =
      device_.api.vkCreateDescriptorPool(device_.host.device, &poolInfo, device_.host.allocationCallbacks, &pool_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateDescriptorPool", result);
  const std::vector<VkDescriptorSetLayout> layouts(inFlight_, setLayout_);
  sets_.resize(inFlight_);
  auto info = begin<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  info.descriptorPool = pool_;
  info.descriptorSetCount = inFlight_;
  info.pSetLayouts = layouts.data();
  result = device_.api.vkAllocateDescriptorSets(device_.host.device, &info, sets_.data());
  if (result != VK_SUCCESS) return vulkanError("vkAllocateDescriptorSets", result);
  return {};
}

Result<VkPipeline> Passes::pipeline(const PassKey& key) {
  // The place first, so that no pipeline is lost where there is no memory for it.
  VkPipeline& place = pipelines_[key];
  if (place != VK_NULL_HANDLE) return place;
  const std::uint32_t constants[] = {key.index, key.filter, key.shadow, key.grids, key.layers};
  auto made = makeComputePipeline(device_, key.shader == Shader::voxels ? "billow voxels" : "billow march",
                                  pipelineLayout_, spirvOf(key.shader), constants);
  if (made) place = *made;
  return made;
}

void Passes::bind(VkCommandBuffer commands, std::span<const VkImageView> atlases, std::span<const std::byte> params,
                  VkImageView color, VkImageView depth) {
  const std::uint64_t offset = next_ * kParamsStride;
  const VkDescriptorSet set = sets_[next_];
  next_ = (next_ + 1) % inFlight_;
  std::memcpy(params_.mapped().subspan(offset, params.size()).data(), params.data(), params.size());
  const VkDescriptorBufferInfo bufferInfo{params_.handle(), offset, params.size()};
  // Bindings of layers that are not there hold the first one's.
  const auto atlas = [&](std::size_t layer) { return atlases[layer < atlases.size() ? layer : 0]; };
  const VkImageView views[kBindings] = {VK_NULL_HANDLE, atlas(0), color, depth, atlas(1), atlas(2), atlas(3)};
  std::array<VkDescriptorImageInfo, kBindings> images{};
  std::array<VkWriteDescriptorSet, kBindings> writes{};
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < kBindings; ++i) {
    if (i != 0 && views[i] == VK_NULL_HANDLE) continue;
    const VkImageLayout layout =
        i == kColorBinding || i == kDepthBinding ? VK_IMAGE_LAYOUT_GENERAL : VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    images[i] = {VK_NULL_HANDLE, views[i], layout};
    VkWriteDescriptorSet& write = writes[count++];
    write = begin<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    write.dstSet = set;
    write.dstBinding = i;
    write.descriptorCount = 1;
    write.descriptorType = bindingType(i);
    write.pImageInfo = &images[i];
    write.pBufferInfo = &bufferInfo;
  }
  device_.api.vkUpdateDescriptorSets(device_.host.device, count, writes.data(), 0, nullptr);
  device_.api.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelineLayout_, 0, 1, &set, 0,
                                      nullptr);
}

}  // namespace billow::runtime
