// Pipelines and descriptor sets of the metavoxel passes.
#ifndef BILLOW_RUNTIME_METAVOXEL_PIPELINES_H
#define BILLOW_RUNTIME_METAVOXEL_PIPELINES_H

#include <map>
#include <span>
#include <tuple>

#include "frame.h"
#include "resources.h"

namespace billow::runtime {

enum class MetavoxelPass : std::uint32_t {
  clear,
  reset,
  spawn,
  binCount,
  binWrite,
  binVolume,
  plan,
  rank,
  blocks,
  fill,
  fillVolume,
  sum,
  light,
  inject,
  pyramid,
  gather,
  shadow,
  keep,
  spare,
  compare,
  marchHalf,
  marchSingle,
  finishHalf,
  finishSingle,
};

// What a draw may ask of passes: those that it concerns are made once with it and once without.
struct PassVariant {
  bool weighted = false;     // Blend::weighted
  bool sceneShadow = false;  // there is a shadow map
};

// Push constants, as shaders/metavoxel.glsl has them.
struct PassPush {
  std::uint32_t round = 0, volume = 0, finish = 0, level = 0;
  std::uint32_t box[4] = {0, 0, 0, 0};
};

class MetavoxelPipelines {
 public:
  MetavoxelPipelines(Device& device, const MetavoxelConfig& config)
      : device_(device),
        inFlight_(config.recordsInFlight),
        layers_(config.maxVolumes * kMostLayers),
        uses_(config.tables != nullptr ? usesOf(config.tables->materials) : 0),
        field_(config.lightField != 0) {}
  MetavoxelPipelines(const MetavoxelPipelines&) = delete;
  MetavoxelPipelines& operator=(const MetavoxelPipelines&) = delete;
  ~MetavoxelPipelines();

  Result<void> create();
  // The passes of one layer are made for the grids that it reads and their indices; others have none.
  Result<VkPipeline> pipeline(MetavoxelPass pass, PassVariant variant, const FrameIndices& indices = {});

  // Writes the sets of one draw in flight, whose layers have these atlases.
  void write(const MetavoxelResources& resources, std::uint32_t inFlight, const MetavoxelDraw& draw,
             std::span<const VkImageView> atlases);
  // Binds a draw's space and its view, or one of its layers.
  void bindView(VkCommandBuffer commands, std::uint32_t inFlight) const;
  void bindLayer(VkCommandBuffer commands, std::uint32_t inFlight, std::uint32_t layer) const;
  void push(VkCommandBuffer commands, const PassPush& push) const;

 private:
  static std::uint32_t usesOf(std::span<const format::ParticleMaterial> materials);  // gpu::kUse...
  using Key = std::tuple<MetavoxelPass, std::uint32_t, std::uint32_t, bool>;         // pass, index kind, grids, variant
  Result<void> createLayouts();
  Result<void> createSets();
  void bind(VkCommandBuffer commands, VkDescriptorSet first, VkDescriptorSet second) const;
  VkDescriptorSet& matter(std::uint32_t inFlight, std::uint32_t number) {
    return matter_[inFlight * (layers_ + 1) + number];
  }

  Device& device_;
  std::uint32_t inFlight_;
  std::uint32_t layers_;  // of a draw, at most
  std::uint32_t uses_;
  bool field_;
  VkDescriptorSetLayout matterLayout_ = VK_NULL_HANDLE;  // MarchParams and a frame's atlas
  VkDescriptorSetLayout spaceLayout_ = VK_NULL_HANDLE;   // MetavoxelParams and all images
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  std::vector<VkDescriptorSet> matter_;  // a draw in flight: the view's, then one a layer
  std::vector<VkDescriptorSet> space_;   // one a draw in flight
  std::map<Key, VkPipeline> pipelines_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_PIPELINES_H
