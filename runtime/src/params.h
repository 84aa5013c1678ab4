// From what the host says to what the shaders read.
#ifndef BILLOW_RUNTIME_PARAMS_H
#define BILLOW_RUNTIME_PARAMS_H

#include "frame.h"

namespace billow::runtime {

// Fails when a grid's index-to-world matrix has no inverse.
Result<gpu::GridParams> gridParams(const ResidentGrid& grid, const std::array<double, 3>& eye, Filter filter);
Result<gpu::MarchParams> marchParams(const ResidentFrame& frame, const DrawInfo& draw);
Result<gpu::MarchParams> lookupParams(const ResidentFrame& frame, Filter filter);

// World from index (3x4 row-major) turned round; false where it has no inverse.
bool invertAffine(const double (&m)[12], double (&inverse)[12]);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_PARAMS_H
