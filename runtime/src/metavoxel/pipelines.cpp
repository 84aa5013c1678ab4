#include "pipelines.h"

#include <algorithm>
#include <span>

#include "compute_pipeline.h"
#include "passes.h"
#include "spirv.h"

namespace billow::runtime {
namespace {

struct Program {
  std::span<const std::uint32_t> code;
  const char* name;
};

// In the order of MetavoxelPass.
const Program& programOf(MetavoxelPass pass) {
  static const Program programs[] = {{spirv::kMetavoxelClear, "billow clear"},
                                     {spirv::kMetavoxelReset, "billow reset"},
                                     {spirv::kMetavoxelSpawn, "billow spawn"},
                                     {spirv::kMetavoxelBin, "billow bin, counting"},
                                     {spirv::kMetavoxelBin, "billow bin"},
                                     {spirv::kMetavoxelBinVolume, "billow bin volumes"},
                                     {spirv::kMetavoxelPlan, "billow plan"},
                                     {spirv::kMetavoxelRank, "billow rank"},
                                     {spirv::kMetavoxelBlocks, "billow blocks"},
                                     {spirv::kMetavoxelFill, "billow fill"},
                                     {spirv::kMetavoxelFillVolume, "billow fill volumes"},
                                     {spirv::kMetavoxelSum, "billow sum"},
                                     {spirv::kMetavoxelLight, "billow light"},
                                     {spirv::kMetavoxelInject, "billow inject"},
                                     {spirv::kMetavoxelPyramid, "billow pyramid"},
                                     {spirv::kMetavoxelGather, "billow gather"},
                                     {spirv::kMetavoxelShadow, "billow shadow"},
                                     {spirv::kMetavoxelKeep, "billow keep"},
                                     {spirv::kMetavoxelSpare, "billow spare"},
                                     {spirv::kMetavoxelCompare, "billow compare"},
                                     {spirv::kMetavoxelMarchHalf, "billow march (half)"},
                                     {spirv::kMetavoxelMarchSingle, "billow march (single)"},
                                     {spirv::kMetavoxelFinishHalf, "billow finish (half)"},
                                     {spirv::kMetavoxelFinishSingle, "billow finish (single)"}};
  return programs[static_cast<std::size_t>(pass)];
}

// Bindings of shaders/metavoxel*.glsl, set 1.
enum SpaceBinding : std::uint32_t {
  params,
  poolTexels,
  poolFiltered,
  cubes,
  shadow,
  color,
  depth,
  sceneDepth,
  sceneShadow,
  pyramidTexels,
  pyramidFiltered,
  fieldTexels,
  fieldFiltered,
  kCount
};

VkDescriptorType typeOf(std::uint32_t binding) {
  if (binding == params) return VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
  if (binding == sceneShadow) return VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
  const bool filtered =
      binding == poolFiltered || binding == cubes || binding == pyramidFiltered || binding == fieldFiltered;
  return filtered ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER : VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
}

VkWriteDescriptorSet writeOf(VkDescriptorSet set, std::uint32_t binding, VkDescriptorType type,
                             const VkDescriptorBufferInfo* buffer, const VkDescriptorImageInfo* image) {
  auto write = begin<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
  write.dstSet = set;
  write.dstBinding = binding;
  write.descriptorCount = 1;
  write.descriptorType = type;
  write.pBufferInfo = buffer;
  write.pImageInfo = image;
  return write;
}

VkDescriptorSetLayoutBinding computeBinding(std::uint32_t binding, VkDescriptorType type) {
  return {binding, type, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
}

}  // namespace

MetavoxelPipelines::~MetavoxelPipelines() {
  const VkDevice device = device_.host.device;
  for (const auto& [key, pipeline] : pipelines_)
    device_.api.vkDestroyPipeline(device, pipeline, device_.host.allocationCallbacks);
  if (pool_ != VK_NULL_HANDLE) device_.api.vkDestroyDescriptorPool(device, pool_, device_.host.allocationCallbacks);
  if (layout_ != VK_NULL_HANDLE) device_.api.vkDestroyPipelineLayout(device, layout_, device_.host.allocationCallbacks);
  for (const VkDescriptorSetLayout layout : {matterLayout_, spaceLayout_}) {
    if (layout != VK_NULL_HANDLE)
      device_.api.vkDestroyDescriptorSetLayout(device, layout, device_.host.allocationCallbacks);
  }
}

std::uint32_t MetavoxelPipelines::usesOf(std::span<const format::ParticleMaterial> materials) {
  std::uint32_t uses = 0;
  for (const format::ParticleMaterial& material : materials) {
    if (material.erosion > 0) uses |= gpu::kUseErosion;
    if (material.diffuseRamp != format::kNoRow || material.emissionRamp != format::kNoRow) uses |= gpu::kUseRamps;
    if (material.profile == format::kProfileCurve) uses |= gpu::kUseCurves;
  }
  return uses;
}

Result<void> MetavoxelPipelines::create() {
  if (auto made = createLayouts(); !made) return made;
  return createSets();
}

Result<void> MetavoxelPipelines::createLayouts() {
  const VkDescriptorSetLayoutBinding matter[] = {computeBinding(0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER),
                                                 computeBinding(1, VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE)};
  VkDescriptorSetLayoutBinding space[kCount];
  for (std::uint32_t i = 0; i < kCount; ++i) space[i] = computeBinding(i, typeOf(i));
  auto setInfo = begin<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  setInfo.bindingCount = 2;
  setInfo.pBindings = matter;
  VkResult result = device_.api.vkCreateDescriptorSetLayout(device_.host.device, &setInfo,
                                                            device_.host.allocationCallbacks, &matterLayout_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateDescriptorSetLayout", result);
  setInfo.bindingCount = kCount;
  setInfo.pBindings = space;
  result = device_.api.vkCreateDescriptorSetLayout(device_.host.device, &setInfo, device_.host.allocationCallbacks,
                                                   &spaceLayout_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateDescriptorSetLayout", result);
  const VkDescriptorSetLayout layouts[] = {matterLayout_, spaceLayout_};
  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(PassPush)};
  auto info = begin<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  info.setLayoutCount = 2;
  info.pSetLayouts = layouts;
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &range;
  result = device_.api.vkCreatePipelineLayout(device_.host.device, &info, device_.host.allocationCallbacks, &layout_);
  if (result != VK_SUCCESS) return vulkanError("vkCreatePipelineLayout", result);
  return {};
}

Result<void> MetavoxelPipelines::createSets() {
  const std::uint32_t matters = inFlight_ * (layers_ + 1);
  const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, matters + inFlight_},
                                        {VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, matters + inFlight_},
                                        {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 4 * inFlight_},
                                        {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, kCount * inFlight_}};
  auto poolInfo = begin<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  poolInfo.maxSets = matters + inFlight_;
  poolInfo.poolSizeCount = 4;
  poolInfo.pPoolSizes = sizes;
  VkResult result =
      device_.api.vkCreateDescriptorPool(device_.host.device, &poolInfo, device_.host.allocationCallbacks, &pool_);
  if (result != VK_SUCCESS) return vulkanError("vkCreateDescriptorPool", result);
  const auto allocate = [&](VkDescriptorSetLayout layout, std::uint32_t count, std::vector<VkDescriptorSet>& sets) {
    const std::vector<VkDescriptorSetLayout> layouts(count, layout);
    sets.resize(count);
    auto info = begin<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    info.descriptorPool = pool_;
    info.descriptorSetCount = count;
    info.pSetLayouts = layouts.data();
    result = device_.api.vkAllocateDescriptorSets(device_.host.device, &info, sets.data());
    return result == VK_SUCCESS;
  };
  if (!allocate(matterLayout_, matters, matter_) || !allocate(spaceLayout_, inFlight_, space_)) {
    return vulkanError("vkAllocateDescriptorSets", result);
  }
  return {};
}

Result<VkPipeline> MetavoxelPipelines::pipeline(MetavoxelPass pass, PassVariant variant, const FrameIndices& indices) {
  using enum MetavoxelPass;
  variant.weighted = variant.weighted && (pass == fill || pass == fillVolume);
  variant.sceneShadow = variant.sceneShadow && (pass == light || pass == inject || pass == MetavoxelPass::shadow);
  const PassKey grids = passKey(indices, Shader::voxels, Filter::trilinear, Filter::none);
  const Key key{pass, grids.index, grids.grids, variant.weighted || variant.sceneShadow};
  // The place first, so that no pipeline is lost where there is no memory for it.
  VkPipeline& place = pipelines_[key];
  if (place != VK_NULL_HANDLE) return place;
  const std::uint32_t constants[] = {grids.index,
                                     gpu::kFilterTrilinear,
                                     gpu::kFilterNone,
                                     grids.grids,
                                     pass == binWrite ? 1u : 0u,
                                     uses_,
                                     variant.weighted ? 1u : 0u,
                                     variant.sceneShadow ? 1u : 0u,
                                     field_ ? 1u : 0u};
  auto made = makeComputePipeline(device_, programOf(pass).name, layout_, programOf(pass).code, constants);
  if (made) place = *made;
  return made;
}

void MetavoxelPipelines::write(const MetavoxelResources& resources, std::uint32_t inFlight, const MetavoxelDraw& draw,
                               std::span<const VkImageView> atlases) {
  const MetavoxelUpload upload = resources.uploadOf(inFlight);
  const VkBuffer uploads = resources.uploads.handle();
  const VkDescriptorBufferInfo spaceParams{uploads, upload.space, sizeof(gpu::MetavoxelParams)};
  // Where the host has no images of the scene, any of their kind are bound, and not read.
  const bool shadowed = draw.sceneShadow.view != VK_NULL_HANDLE;
  const VkImageView scene = draw.sceneDepth != VK_NULL_HANDLE ? draw.sceneDepth : draw.depth;
  // So it is where there is no light field.
  const bool field = resources.sizes().field.edge != 0;
  const VkImageView pyramid = field ? resources.pyramid.view() : resources.pool.view();
  const VkImageView light = field ? resources.field.view() : resources.pool.view();
  const VkImageView views[kCount] = {VK_NULL_HANDLE,
                                     resources.pool.view(),
                                     resources.pool.view(),
                                     resources.cubes.view(),
                                     resources.shadow.view(),
                                     draw.color,
                                     draw.depth,
                                     scene,
                                     shadowed ? draw.sceneShadow.view : resources.shadow.view(),
                                     pyramid,
                                     pyramid,
                                     light,
                                     light};
  VkDescriptorImageInfo images[kCount];
  VkWriteDescriptorSet writes[kCount];
  for (std::uint32_t i = 0; i < kCount; ++i) {
    images[i] = {resources.sampler, views[i],
                 i == cubes ? VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL : VK_IMAGE_LAYOUT_GENERAL};
    if (i == sceneShadow && shadowed) images[i].imageLayout = draw.sceneShadow.layout;
    writes[i] = writeOf(space_[inFlight], i, typeOf(i), &spaceParams, &images[i]);
  }
  device_.api.vkUpdateDescriptorSets(device_.host.device, kCount, writes, 0, nullptr);
  for (std::uint32_t i = 0; i <= atlases.size(); ++i) {
    const VkDescriptorBufferInfo params{uploads, upload.view + i * kMarchStride, sizeof(gpu::MarchParams)};
    // The view has no atlas; the pool is an image of its kind.
    VkDescriptorImageInfo atlas{VK_NULL_HANDLE, resources.pool.view(), VK_IMAGE_LAYOUT_GENERAL};
    if (i > 0) {
      atlas.imageView = atlases[i - 1];
      atlas.imageLayout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;
    }
    const VkDescriptorSet set = matter(inFlight, i);
    const VkWriteDescriptorSet both[] = {writeOf(set, 0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, &params, nullptr),
                                         writeOf(set, 1, VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, nullptr, &atlas)};
    device_.api.vkUpdateDescriptorSets(device_.host.device, 2, both, 0, nullptr);
  }
}

void MetavoxelPipelines::bind(VkCommandBuffer commands, VkDescriptorSet first, VkDescriptorSet second) const {
  const VkDescriptorSet sets[] = {first, second};
  device_.api.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 2, sets, 0, nullptr);
}

void MetavoxelPipelines::bindView(VkCommandBuffer commands, std::uint32_t inFlight) const {
  bind(commands, matter_[inFlight * (layers_ + 1)], space_[inFlight]);
}

void MetavoxelPipelines::bindLayer(VkCommandBuffer commands, std::uint32_t inFlight, std::uint32_t layer) const {
  bind(commands, matter_[inFlight * (layers_ + 1) + layer + 1], space_[inFlight]);
}

void MetavoxelPipelines::push(VkCommandBuffer commands, const PassPush& push) const {
  device_.api.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push), &push);
}

}  // namespace billow::runtime
