// Drawing by metavoxels: a space around what is to be seen, and the particles of effects.
#ifndef BILLOW_COMMAND_RENDER_METAVOXEL_H
#define BILLOW_COMMAND_RENDER_METAVOXEL_H

#include <memory>
#include <vector>

#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "billow/runtime/metavoxel.h"
#include "render_contents.h"

namespace billow::command {

// The box grown to hold another, and the particles' bounding spheres.

// What there is to draw at one moment.
struct Shown {
  std::vector<runtime::MetavoxelVolume> volumes;
  std::vector<std::vector<runtime::Layer>> layers;  // of the volumes
  Effects effects;
};

// What a space must have room for.
struct SpaceNeeds {
  runtime::WorldBox box;
  VoxelLattice lattice;
  std::uint32_t volumes = 0;    // at once
  std::uint64_t particles = 0;  // no more than a draw's limit
  std::uint32_t recordsInFlight = 1;
};

struct Surroundings {  // as runtime::Scattering has them
  float share = 0;
  std::uint32_t bounces = 1;
};

class MetavoxelPainter {
 public:
  // A space that holds the box from any direction, its voxels those of the lattice or, where that is too fine, larger
  // (edge 0: a 256th of the box).
  static runtime::Result<MetavoxelPainter> make(runtime::Renderer& renderer, const format::EffectTables& tables,
                                                const SpaceNeeds& needs, std::uint64_t memoryBudget,
                                                Surroundings surroundings);

  // `draw` as for the direct method; of its look, how everything scatters. Without shadows light passes unhindered.
  // `shown` must outlive what is made of it.
  runtime::MetavoxelDraw describe(const runtime::DrawInfo& draw, const Shown& shown) const;
  // Says what the last draw had no room for; nothing where it had.
  runtime::Result<void> checkRoom() const;
  runtime::Metavoxels& metavoxels() { return *metavoxels_; }
  float voxelSize() const { return voxelSize_; }

  runtime::Result<headless::Picture> render(headless::Headless& gpu, runtime::Renderer& renderer,
                                            const runtime::DrawInfo& draw, const Shown& shown);

 private:
  std::unique_ptr<runtime::Metavoxels> metavoxels_;
  std::array<double, 3> center_{}, anchor_{};
  float voxelSize_ = 0;
  Surroundings surroundings_;
  std::uint32_t mostEntries_ = 0;
};

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_METAVOXEL_H
