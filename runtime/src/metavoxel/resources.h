// Buffers, images and tables of a Metavoxels, all allocated when it is made.
#ifndef BILLOW_RUNTIME_METAVOXEL_RESOURCES_H
#define BILLOW_RUNTIME_METAVOXEL_RESOURCES_H

#include <algorithm>

#include "memory.h"
#include "sizes.h"

namespace billow::runtime {

// One draw's part of the memory that the host writes.
struct MetavoxelUpload {
  std::uint64_t view;       // offset of MarchParams
  std::uint64_t layers;     // of one MarchParams a layer, kMarchStride apart
  std::uint64_t space;      // of MetavoxelParams
  std::uint64_t particles;  // of the host's Particles, and behind them the effects' jobs
};

// At least as large as any device's uniform buffer alignment.
inline constexpr std::uint64_t kMarchStride =
    (std::max(sizeof(gpu::MarchParams), sizeof(gpu::MetavoxelParams)) + 255) / 256 * 256;

class MetavoxelResources {
 public:
  explicit MetavoxelResources(Device& device) : device_(device) {}
  MetavoxelResources(const MetavoxelResources&) = delete;
  MetavoxelResources& operator=(const MetavoxelResources&) = delete;
  ~MetavoxelResources();

  // Makes the pool as large as the budget allows. Fails with budget where that is less than a few metavoxels.
  Result<void> create(const MetavoxelConfig& config);

  const MetavoxelSizes& sizes() const { return sizes_; }
  VkDeviceAddress address(std::uint64_t region) const { return arrays.address() + region; }
  MetavoxelUpload uploadOf(std::uint32_t inFlight) const;
  std::uint64_t bytes() const;
  // Where the arrays lie.
  void addAddresses(gpu::MetavoxelParams& params) const;

  // Makes images usable, empties the tables of cells and copies the particles' tables. For the first draw.
  void recordFirst(VkCommandBuffer commands) const;

  Buffer arrays;    // MetavoxelRegions
  Buffer uploads;   // MetavoxelUpload for each draw in flight
  Buffer counters;  // MetavoxelCounters for each draw in flight, read by the host
  Image pool, cubes, shadow;
  Image pyramid, field;  // where there is a light field
  VkSampler sampler = VK_NULL_HANDLE;

 private:
  Result<void> makeAll(const MetavoxelConfig& config, std::uint64_t slots);
  Result<void> makeField();
  Result<void> bindAll();
  Result<void> createSampler();
  void fillTables(const MetavoxelConfig& config);

  Device& device_;
  MetavoxelSizes sizes_{};
  std::uint64_t uploadStride_ = 0;
  std::uint32_t layers_ = 0;  // of a draw, at most
  bool hasRadii_ = false;     // tracks have
  Buffer tables_;  // materials, curves, ramps, emitters, tracks, given particles, meshes, maps' texels, until they are
                   // copied
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_RESOURCES_H
