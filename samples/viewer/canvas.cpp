#include "canvas.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace billow::viewer {
namespace {

namespace spirv {
using std::uint32_t;
#include "present.spv.h"
}  // namespace spirv

using headless::begin;

constexpr ImageUse kOverwritten{VK_IMAGE_LAYOUT_UNDEFINED,
                                VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                                VK_ACCESS_2_NONE};
constexpr ImageUse kWritten{VK_IMAGE_LAYOUT_GENERAL, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT,
                            VK_ACCESS_2_SHADER_WRITE_BIT};
constexpr ImageUse kRead{VK_IMAGE_LAYOUT_GENERAL, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_READ_BIT};
constexpr ImageUse kCopied{VK_IMAGE_LAYOUT_GENERAL, VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT,
                           VK_ACCESS_2_TRANSFER_READ_BIT};

Pipeline makePipeline(VkDevice device, VkPipelineLayout layout) {
  auto moduleInfo = begin<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  moduleInfo.codeSize = sizeof(spirv::kPresent);
  moduleInfo.pCode = spirv::kPresent;
  const auto module = makeOwned<ShaderModule>(device, vkCreateShaderModule, "vkCreateShaderModule", moduleInfo);
  auto info = begin<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = begin<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module.get();
  info.stage.pName = "main";
  info.layout = layout;
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(vkCreateComputePipelines(device, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline), "vkCreateComputePipelines");
  return Pipeline(device, pipeline);
}

}  // namespace

Canvas::Canvas(const headless::VulkanDevice& device) : device_(device) {
  const VkDevice vulkan = device.host.device;
  std::array<VkDescriptorSetLayoutBinding, 2> bindings{};
  for (std::uint32_t i = 0; i < bindings.size(); ++i) {
    bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  }
  auto setInfo = begin<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  setInfo.bindingCount = static_cast<std::uint32_t>(bindings.size());
  setInfo.pBindings = bindings.data();
  setLayout_ =
      makeOwned<DescriptorSetLayout>(vulkan, vkCreateDescriptorSetLayout, "vkCreateDescriptorSetLayout", setInfo);
  const VkDescriptorSetLayout setLayout = setLayout_.get();
  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(float)};
  auto layoutInfo = begin<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layoutInfo.setLayoutCount = layoutInfo.pushConstantRangeCount = 1;
  layoutInfo.pSetLayouts = &setLayout;
  layoutInfo.pPushConstantRanges = &push;
  layout_ = makeOwned<PipelineLayout>(vulkan, vkCreatePipelineLayout, "vkCreatePipelineLayout", layoutInfo);
  pipeline_ = makePipeline(vulkan, layout_.get());
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, 2};
  auto poolInfo = begin<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  poolInfo.maxSets = poolInfo.poolSizeCount = 1;
  poolInfo.pPoolSizes = &size;
  pool_ = makeOwned<DescriptorPool>(vulkan, vkCreateDescriptorPool, "vkCreateDescriptorPool", poolInfo);
  auto info = begin<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  info.descriptorPool = pool_.get();
  info.descriptorSetCount = 1;
  info.pSetLayouts = &setLayout;
  check(vkAllocateDescriptorSets(vulkan, &info, &set_), "vkAllocateDescriptorSets");
}

void Canvas::resize(VkExtent2D size) {
  if (size.width == size_.width && size.height == size_.height) return;
  const VkDevice device = device_.host.device;
  check(vkDeviceWaitIdle(device), "vkDeviceWaitIdle");
  const auto make = [&](VkFormat format) {
    auto target = std::make_unique<headless::Target>(device_);
    valueOf(target->makeImage(format, size.width, size.height));
    return target;
  };
  color_ = make(VK_FORMAT_R32G32B32A32_SFLOAT);
  depth_ = make(VK_FORMAT_R32_SFLOAT);
  shown_ = make(VK_FORMAT_R8G8B8A8_UNORM);
  size_ = size;
  const std::array<VkDescriptorImageInfo, 2> images{
      VkDescriptorImageInfo{VK_NULL_HANDLE, color_->view, VK_IMAGE_LAYOUT_GENERAL},
      VkDescriptorImageInfo{VK_NULL_HANDLE, shown_->view, VK_IMAGE_LAYOUT_GENERAL}};
  auto write = begin<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
  write.dstSet = set_;
  write.descriptorCount = static_cast<std::uint32_t>(images.size());
  write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_IMAGE;
  write.pImageInfo = images.data();
  // Two bindings of one image each: what goes beyond the first goes on with the second.
  vkUpdateDescriptorSets(device, 1, &write, 0, nullptr);
}

void Canvas::recordBegin(VkCommandBuffer commands) const {
  for (const VkImage image : {color_->image, depth_->image}) recordBarrier(commands, image, kOverwritten, kWritten);
}

void Canvas::recordEnd(VkCommandBuffer commands, float exposure) const {
  recordBarrier(commands, color_->image, kWritten, kRead);
  recordBarrier(commands, shown_->image, kOverwritten, kWritten);
  const float gain = std::exp2(exposure);
  vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_.get());
  vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_.get(), 0, 1, &set_, 0, nullptr);
  vkCmdPushConstants(commands, layout_.get(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(gain), &gain);
  vkCmdDispatch(commands, (size_.width + 7) / 8, (size_.height + 7) / 8, 1);
  recordBarrier(commands, shown_->image, kWritten, kCopied);
}

}  // namespace billow::viewer
