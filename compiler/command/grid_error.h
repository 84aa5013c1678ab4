// How far a reconstructed grid is from its source.
#ifndef BILLOW_COMMAND_GRID_ERROR_H
#define BILLOW_COMMAND_GRID_ERROR_H

#include <cstdint>

#include "stages.h"

namespace billow::command {

struct GridError {
  std::uint64_t sourceVoxels = 0;      // active ones
  std::uint64_t mismatchedVoxels = 0;  // active in one of the two only
  double squaredError = 0;             // sum over voxels that are active in both
  double maxError = 0;

  // Root of the mean squared error over the source's active voxels; 0 where there are none.
  double rmse() const;
};

// Both in source index space. `pack` may hold as tiles what `source` holds as leaves, and the reverse.
GridError measureError(const compiler::ImportedGrid& source, const compiler::ImportedGrid& pack);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_GRID_ERROR_H
