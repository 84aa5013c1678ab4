// What a brick's error alone adds to the error of line integrals (depth_error.h): the measure by which encodings are
// weighed against each other where the pack's error is that of depth.
#ifndef BILLOW_COMPILER_DEPTH_DISTORTION_H
#define BILLOW_COMPILER_DEPTH_DISTORTION_H

#include "billow/format/brick.h"

namespace billow::compiler {

// Sum over the lines of kLineDirections, each only as far as it lies in the brick, of the square of step length * sum
// of `error`; in grid units^2 * voxels^2. error: result less source, 0 where inactive.
// Errors of bricks behind one another add up along a line; where they are uncorrelated, the expected squared error of
// the grid is the sum of this over bricks. Deterministic; no allocation.
double depthDistortion(const format::Values& error);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_DEPTH_DISTORTION_H
