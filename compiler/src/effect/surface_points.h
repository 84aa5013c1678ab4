// Meshes to the points on which particles are born.
#ifndef BILLOW_COMPILER_EFFECT_SURFACE_POINTS_H
#define BILLOW_COMPILER_EFFECT_SURFACE_POINTS_H

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "billow/format/surface.h"
#include "effect/description.h"

namespace billow::compiler {

// The box around all vertices.
struct MeshBox {
  std::array<double, 3> middle{};
  std::array<float, 3> halfSides{};
};
MeshBox boxOf(const MeshShape& mesh);

struct Surface : MeshBox {
  std::vector<format::SurfacePoint> points;
};

// `count` points, each the place of an equal share of the area; off by at most half a 32767th of the half sides.
// The mesh must have an area.
Surface placePoints(const MeshShape& mesh, std::uint32_t count);

// How many points serve an emitter that bears so many particles in a run: 4 for each, 1024 to kMaxSurfacePoints.
std::uint32_t pointsFor(std::uint64_t particles);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_SURFACE_POINTS_H
