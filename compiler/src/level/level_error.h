// What is lost by drawing a level in place of its volume.
#ifndef BILLOW_COMPILER_LEVEL_LEVEL_ERROR_H
#define BILLOW_COMPILER_LEVEL_LEVEL_ERROR_H

#include <cstdint>

#include "stages.h"

namespace billow::compiler {

// At the centres of the source's voxels, active or not, between what is linear along each axis between the level's
// voxels, inactive ones at the background, and the source.
struct LevelDifference {
  double squaredError = 0;  // sum over voxels
  double maxError = 0;
  std::uint64_t missed = 0;  // the source's active voxels where the level has nothing, not counted above
};

// `level` in its own index space, as coarsen(source, log2) makes it, whatever its values; its tiles' origins need only
// be multiples of 8. Both have one background. The result does not depend on threads.
LevelDifference measureLevel(const ImportedGrid& source, const ImportedGrid& level, std::uint32_t log2);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_LEVEL_LEVEL_ERROR_H
