// The active voxels of a brick, one after another.
#ifndef BILLOW_COMPILER_ENCODE_ACTIVE_VALUES_H
#define BILLOW_COMPILER_ENCODE_ACTIVE_VALUES_H

#include <cstdint>

#include "encode/texel_range.h"

namespace billow::compiler {

struct ActiveValues {
  explicit ActiveValues(const BrickSource& brick);

  ValueRange range;  // both 0 where no voxel is active
  std::uint32_t count;
  alignas(32) float value[format::kBrickVoxels];  // in the order of voxelIndex
  alignas(32) float place[format::kBrickVoxels];  // in [0, 1] of the range
};

// Numbers in the order of active voxels to their voxels; inactive ones are 0.
void spread(const BrickSource& brick, const float* ofActive, format::Texels& texels);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_ACTIVE_VALUES_H
