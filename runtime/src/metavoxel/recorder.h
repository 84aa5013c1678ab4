// Records a draw's passes, in the order in which they run.
#ifndef BILLOW_RUNTIME_METAVOXEL_RECORDER_H
#define BILLOW_RUNTIME_METAVOXEL_RECORDER_H

#include <array>
#include <optional>
#include <vector>

#include "pipelines.h"
#include "resources.h"
#include "space.h"
#include "spawn.h"

namespace billow::runtime {

struct LayerSteps {
  PlacedLayer placed;
  const ResidentFrame* frame;
  std::uint32_t volume, layer;  // number; among those of the volume that are drawn
  VkPipeline bin = VK_NULL_HANDLE, fill = VK_NULL_HANDLE;
};

// A draw's pipelines and layers, all made before anything is recorded.
struct DrawSteps {
  Space space;
  std::vector<LayerSteps> layers;  // that reach into the space; those of one volume one after the other
  SpawnPlan spawns;
  std::uint32_t particles;  // the host's and the effects'
  VkPipeline clear, reset, spawn, binCount, binWrite, plan, rank, blocks, fill, sum, light, inject, pyramid, gather,
      shadow, march, finish, keep, spare, compare;
};

// Offset of the jobs in the memory that the host writes. None is empty or larger than a particle, so there is room.
std::uint64_t spawnJobsAt(const MetavoxelUpload& upload, const MetavoxelDraw& draw);

class DrawRecorder {
 public:
  DrawRecorder(const Device& device, const MetavoxelResources& resources, const MetavoxelPipelines& pipelines,
               VkCommandBuffer commands, std::uint32_t inFlight)
      : device_(device), resources_(resources), pipelines_(pipelines), commands_(commands), inFlight_(inFlight) {}

  // `first`: no draw of this object was recorded before.
  void record(const MetavoxelDraw& draw, const DrawSteps& steps, bool first, bool keepFilled);

 private:
  void begin(const MetavoxelDraw& draw, const DrawSteps& steps, bool first);
  void bin(const DrawSteps& steps, bool keepFilled);
  void keep(const DrawSteps& steps, std::uint64_t rank);
  void rounds(const MetavoxelDraw& draw, const DrawSteps& steps);
  void fill(const MetavoxelDraw& draw, const DrawSteps& steps, std::uint32_t round, bool first);
  void field(const MetavoxelDraw& draw, const DrawSteps& steps);
  void light(const MetavoxelDraw& draw, const DrawSteps& steps, const PassPush& push);

  std::uint64_t roundAt(std::uint32_t round) const;
  void dispatch(VkPipeline pipeline, const PassPush& push, const std::array<std::uint32_t, 3>& groups);
  void indirect(VkPipeline pipeline, const PassPush& push, std::uint64_t offset);
  void barrier();
  void stamp(const MetavoxelDraw& draw, std::uint32_t number);

  const Device& device_;
  const MetavoxelResources& resources_;
  const MetavoxelPipelines& pipelines_;
  VkCommandBuffer commands_;
  std::uint32_t inFlight_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_RECORDER_H
