// Particles to grids, as whatever fills volumes with them does.
#ifndef BILLOW_COMPILER_EFFECT_RASTERISE_H
#define BILLOW_COMPILER_EFFECT_RASTERISE_H

#include <array>
#include <span>

#include "billow/format/effect.h"
#include "stages.h"

namespace billow::compiler {

struct RasterisedEffect {
  ImportedGrid density;                  // extinction per world unit: the particles' sum
  std::array<ImportedGrid, 3> colour;    // albedo: the largest of them, by component
  std::array<ImportedGrid, 3> emission;  // radiance per world unit: their sum
};

// Voxel (x, y, z) is the point (x, y, z) * voxelSize. Active are the voxels with density. The same bytes for any thread
// count. Throws Error(Fault::commandLine) where the voxels are so small that there would be too many of them.
RasterisedEffect rasterise(const format::EffectTables& tables, std::span<const format::Particle> particles,
                           double voxelSize);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_RASTERISE_H
