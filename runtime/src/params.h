// From what the host says to what the shaders read.
#ifndef BILLOW_RUNTIME_PARAMS_H
#define BILLOW_RUNTIME_PARAMS_H

#include "layers.h"

namespace billow::runtime {

// `widest` is the filter that reaches farthest of those that will read the grid.
gpu::GridParams gridParams(const ResidentGrid& grid, const std::array<double, 3>& eye, Filter widest);
// View, sun, look and quality; no grids.
gpu::MarchParams viewParams(const DrawInfo& draw);
// Two addresses, each as low and high word.
gpu::uvec4 addresses(VkDeviceAddress a, VkDeviceAddress b);
gpu::MarchParams marchParams(const ResidentFrame& frame, const DrawInfo& draw);

// What shaders/bindings.glsl has where several layers are drawn at once.
struct LayeredParams {
  gpu::MarchParams view{};
  std::array<gpu::LayerParams, gpu::kLayerCount> layers{};
};
LayeredParams layeredParams(std::span<const Layer> layers, const DrawInfo& draw);
gpu::MarchParams lookupParams(const ResidentFrame& frame, Filter filter);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_PARAMS_H
