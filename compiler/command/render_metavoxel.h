// Drawing by metavoxels: a space around what is to be seen, and the particles of effects.
#ifndef BILLOW_COMMAND_RENDER_METAVOXEL_H
#define BILLOW_COMMAND_RENDER_METAVOXEL_H

#include <memory>
#include <vector>

#include "billow/headless/headless.h"
#include "billow/runtime/look.h"
#include "billow/runtime/metavoxel.h"
#include "render_request.h"

namespace billow::command {

using Particles = std::vector<format::Particle>;

// The effects to draw at one moment, which the GPU evaluates.
using Effects = std::vector<runtime::MetavoxelEffect>;

// The effects of the pack that are asked for, by number. Refuses names that it has not.
Checked<std::vector<std::uint32_t>> findEffects(const format::Pack& pack, const RenderRequest& request);
Effects effectsAt(const std::vector<std::uint32_t>& effects, double time);  // seconds after their begin
// What is alive of them: for what must be known before a picture is drawn.
Particles particlesOf(const format::Pack& pack, const Effects& effects);
// How many a draw of them may have.
std::uint64_t mostParticles(const format::Pack& pack, const Effects& effects);

// The box grown to hold the particles' bounding spheres.
void addParticles(const Particles& particles, runtime::WorldBox& box);

// The smallest voxels of the grids: their edge, world units (0 where there is no grid), and the centre of one.
struct VoxelLattice {
  double edge = 0;
  std::array<double, 3> anchor{};
};
VoxelLattice finestVoxels(const format::Pack& pack, const format::VolumeRecord& volume,
                          const runtime::GridChoice& grids);

class MetavoxelPainter {
 public:
  // A space that holds `box` from any direction, its voxels those of the lattice or, where that is too fine, larger
  // (edge 0: a 256th of the box). No picture has more than so many particles.
  static runtime::Result<MetavoxelPainter> make(runtime::Renderer& renderer, const format::Pack& pack,
                                                const runtime::WorldBox& box, const VoxelLattice& lattice,
                                                std::uint64_t particles, std::uint64_t memoryBudget);

  // `draw` as for the direct method; its frame may be null. Without shadows light passes unhindered.
  runtime::Result<headless::Picture> render(headless::Headless& gpu, runtime::Renderer& renderer,
                                            const runtime::DrawInfo& draw, const Effects& effects);

 private:
  std::unique_ptr<runtime::Metavoxels> metavoxels_;
  std::array<double, 3> center_{}, anchor_{};
  float voxelSize_ = 0;
  std::uint32_t mostEntries_ = 0;
};

}  // namespace billow::command

#endif  // BILLOW_COMMAND_RENDER_METAVOXEL_H
