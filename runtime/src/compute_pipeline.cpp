#include "compute_pipeline.h"

#include <vector>

#include "debug.h"

namespace billow::runtime {

Result<VkPipeline> makeComputePipeline(const Device& device, const char* name, VkPipelineLayout layout,
                                       std::span<const std::uint32_t> code, std::span<const std::uint32_t> constants) {
  std::vector<VkSpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < constants.size(); ++i) entries.push_back({i, 4 * i, 4});
  const VkSpecializationInfo specialization{static_cast<std::uint32_t>(entries.size()), entries.data(),
                                            constants.size_bytes(), constants.data()};
  auto moduleInfo = begin<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  moduleInfo.codeSize = code.size_bytes();
  moduleInfo.pCode = code.data();
  VkShaderModule module = VK_NULL_HANDLE;
  VkResult result =
      device.api.vkCreateShaderModule(device.host.device, &moduleInfo, device.host.allocationCallbacks, &module);
  if (result != VK_SUCCESS) return vulkanError("vkCreateShaderModule", result);
  auto info = begin<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = begin<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module;
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = &specialization;
  info.layout = layout;
  VkPipeline pipeline = VK_NULL_HANDLE;
  result = device.api.vkCreateComputePipelines(device.host.device, device.host.pipelineCache, 1, &info,
                                               device.host.allocationCallbacks, &pipeline);
  device.api.vkDestroyShaderModule(device.host.device, module, device.host.allocationCallbacks);
  if (result != VK_SUCCESS) return vulkanError("vkCreateComputePipelines", result);
  nameObject(device, VK_OBJECT_TYPE_PIPELINE, pipeline, name);
  return pipeline;
}

}  // namespace billow::runtime
