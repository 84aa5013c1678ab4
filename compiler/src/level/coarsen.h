// A grid in larger voxels, so that what a ray gathers of it stays the same.
#ifndef BILLOW_COMPILER_LEVEL_COARSEN_H
#define BILLOW_COMPILER_LEVEL_COARSEN_H

#include <cstdint>

#include "stages.h"

namespace billow::compiler {

// Voxel c is the mean of the voxels f c to f c + f - 1 on each axis, f = 2^log2, those that are not active with the
// background, and is active where one of them is; indexToWorld puts its centre in their midst. log2 is 1 to 3. Means
// are summed in double precision; the result does not depend on threads. A grid that is not present comes back as it
// is.
ImportedGrid coarsen(const ImportedGrid& grid, std::uint32_t log2);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_LEVEL_COARSEN_H
