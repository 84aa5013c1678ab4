// Where a draw's space lies, and what the shaders read of a draw.
#ifndef BILLOW_RUNTIME_METAVOXEL_SPACE_H
#define BILLOW_RUNTIME_METAVOXEL_SPACE_H

#include <optional>

#include "layers.h"
#include "sizes.h"

namespace billow::runtime {

using Vec3d = std::array<double, 3>;

struct Space {
  std::array<Vec3d, 3> axes;  // orthonormal, world; z runs along the light
  Vec3d center;               // world
  double voxel;               // world units
  double half;                // voxels from a corner to the middle
  std::uint32_t axis, inner;  // cells, voxels a cell
};

Space spaceOf(const MetavoxelDraw& draw, const MetavoxelSizes& sizes);

struct CellRange {  // of cells, at least one along each axis
  std::array<std::uint32_t, 3> first, count;
};

// A layer of a volume where the draw puts it. None where the volume's transform cannot be turned round.
struct PlacedLayer {
  gpu::MarchParams params;
  std::optional<CellRange> cells;  // those that its grids may reach; none: it is outside of the space
};
std::optional<PlacedLayer> placeLayer(const Space& space, const MetavoxelDraw& draw, const MetavoxelVolume& volume,
                                      const Layer& layer);

// Voxels around what the eye sees in which matter counts for its light.
inline constexpr double kUnseenLight = 64;

// Whether matter lights matter in this draw.
bool fieldDrawn(const MetavoxelDraw& draw, const MetavoxelSizes& sizes);

// View, sun and scattering.
gpu::MarchParams viewOf(const MetavoxelDraw& draw);

// All but the addresses. `number` counts draws. None where the scene's shadow map does not lie along the light.
std::optional<gpu::MetavoxelParams> paramsOf(const Space& space, const MetavoxelDraw& draw,
                                             const MetavoxelConfig& config, const MetavoxelSizes& sizes,
                                             std::uint32_t number);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_SPACE_H
