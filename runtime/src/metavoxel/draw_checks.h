// What the arguments of Metavoxels::record() allow.
#ifndef BILLOW_RUNTIME_METAVOXEL_DRAW_CHECKS_H
#define BILLOW_RUNTIME_METAVOXEL_DRAW_CHECKS_H

#include "api.h"
#include "billow/runtime/metavoxel.h"

namespace billow::runtime {

tl::unexpected<Error> badArgument(const std::string& what);

// All but the particles and the transforms of volumes.
Result<void> checkDraw(const MetavoxelDraw& draw, const MetavoxelConfig& config);

// The first field that a shader could not take, or null. Numbers that are merely odd draw something odd.
const char* badParticle(const format::Particle& particle, std::size_t materials, std::size_t maps);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_DRAW_CHECKS_H
