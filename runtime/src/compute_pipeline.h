// A compute pipeline of one of the embedded shaders.
#ifndef BILLOW_RUNTIME_COMPUTE_PIPELINE_H
#define BILLOW_RUNTIME_COMPUTE_PIPELINE_H

#include <cstdint>
#include <span>

#include "memory.h"

namespace billow::runtime {

// `name` is what debuggers call it. Specialization constant i is constants[i]; those that the shader lacks are passed
// over. The caller destroys it.
Result<VkPipeline> makeComputePipeline(const Device& device, const char* name, VkPipelineLayout layout,
                                       std::span<const std::uint32_t> code, std::span<const std::uint32_t> constants);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_COMPUTE_PIPELINE_H
