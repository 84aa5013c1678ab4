// Pipelines, descriptor sets and parameters: what record() needs, all made ahead save for a new combination's pipeline.
#ifndef BILLOW_RUNTIME_PASSES_H
#define BILLOW_RUNTIME_PASSES_H

#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "layers.h"

namespace billow::runtime {

enum class Shader : std::uint32_t { marchHalf, marchSingle, marchLayersHalf, marchLayersSingle, voxels };

// What a pipeline is specialised for.
struct PassKey {
  Shader shader = Shader::marchHalf;
  std::uint32_t index = gpu::kIndexMixed;
  std::uint32_t filter = gpu::kFilterTrilinear;
  std::uint32_t shadow = gpu::kFilterTrilinear;
  std::uint32_t grids = 0;
  std::uint32_t layers = 1;
  bool operator<(const PassKey& other) const {
    return std::tie(shader, index, filter, shadow, grids, layers) <
           std::tie(other.shader, other.index, other.filter, other.shadow, other.grids, other.layers);
  }
};

PassKey passKey(const FrameIndices& indices, Shader shader, Filter filter, Filter shadow);
// Of all layers together; one that lacks a grid reads zeros there.
PassKey passKey(std::span<const Layer> layers, Shader shader, Filter filter, Filter shadow);

class Passes {
 public:
  Passes(Device& device, std::uint32_t inFlight) : device_(device), inFlight_(inFlight) {}
  Passes(const Passes&) = delete;
  Passes& operator=(const Passes&) = delete;
  ~Passes();

  Result<void> create();
  Result<VkPipeline> pipeline(const PassKey& key);

  // Takes the next descriptor set and parameter slot of the ring, fills and binds them. `color` and `depth` may be null
  // where the shader has no images. `params`: MarchParams or LayeredParams; `atlases`: one a layer, at least one.
  void bind(VkCommandBuffer commands, std::span<const VkImageView> atlases, std::span<const std::byte> params,
            VkImageView color, VkImageView depth);
  VkPipelineLayout layout() const { return pipelineLayout_; }

 private:
  Result<void> createLayouts();
  Result<void> createSets();

  Device& device_;
  std::uint32_t inFlight_;
  std::uint32_t next_ = 0;
  VkDescriptorSetLayout setLayout_ = VK_NULL_HANDLE;
  VkPipelineLayout pipelineLayout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  std::vector<VkDescriptorSet> sets_;
  Buffer params_;
  std::map<PassKey, VkPipeline> pipelines_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_PASSES_H
