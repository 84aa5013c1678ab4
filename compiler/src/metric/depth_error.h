// The error that rays see: of line integrals instead of voxels. A ray's optical depth (and the emission that thin gas
// sends along it) is the integral of the grid's values, so errors that differ from voxel to voxel average out along it,
// and those that agree add up. The error of a picture follows this one closer than that of voxels.
#ifndef BILLOW_COMPILER_DEPTH_ERROR_H
#define BILLOW_COMPILER_DEPTH_ERROR_H

#include <array>
#include <cstddef>
#include <cstdint>

#include "stages.h"

namespace billow::compiler {

// A family of parallel lattice lines. A voxel p lies on exactly one of them: line (u . p, p[v]).
struct LineDirection {
  std::array<std::int32_t, 3> u;  // each -1, 0 or 1
  std::size_t v;                  // an axis
  bool diagonal;                  // the step from voxel to voxel is sqrt(2) voxels long instead of 1
};

// The three axes and the six diagonals of a cell's faces. Along these every voxel centre lies on one line, so that
// integrals are plain sums, without interpolation. The cell's four space diagonals are left out: their lines lie far
// apart and their samples sqrt(3) voxels, too coarse to stand for a ray.
inline constexpr std::array<LineDirection, 9> kLineDirections{{
    {{0, 1, 0}, 2, false},  // x
    {{1, 0, 0}, 2, false},  // y
    {{1, 0, 0}, 1, false},  // z
    {{1, -1, 0}, 2, true},  // (1, 1, 0)
    {{1, 1, 0}, 2, true},   // (1, -1, 0)
    {{1, 0, -1}, 1, true},  // (1, 0, 1)
    {{1, 0, 1}, 1, true},   // (1, 0, -1)
    {{0, 1, -1}, 0, true},  // (0, 1, 1)
    {{0, 1, 1}, 0, true},   // (0, 1, -1)
}};

// A line's integral: step length (in voxels: 1, or sqrt(2) along diagonals) * sum of (value - background) over it.
struct DepthError {
  std::uint64_t lines = 0;     // of all nine directions that meet an active voxel of source or result
  double squaredError = 0;     // sum over lines of (result's integral - source's)^2, grid unit^2 * voxels^2
  double leastIntegral = 0;    // of the source's lines, and of lines that miss the grid: at most 0
  double largestIntegral = 0;  // at least 0

  double range() const;
  double rmse() const;  // 0 where there are no lines
  // Decibels, 20 log10(range / rmse); infinite where no line differs, minus infinite where some do and range is 0.
  double psnr() const;
};

// Both in the same index space, inactive leaf voxels at the background; tiles' origins need only be multiples of 8.
// Lengths are in index space: a grid with voxels of unequal sides is measured as if they were cubes.
// Memory grows with leaves and tiles, not with the space between them. The result does not depend on threads.
DepthError measureDepth(const ImportedGrid& source, const ImportedGrid& result);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_DEPTH_ERROR_H
