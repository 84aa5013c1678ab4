// How uniform bricks find their lo and scale.
#ifndef BILLOW_COMPILER_ENCODE_UNIFORM_FIT_H
#define BILLOW_COMPILER_ENCODE_UNIFORM_FIT_H

#include "encode/active_values.h"

namespace billow::compiler {

// What shortening lo and scale may add to the squared error, as a part of it.
inline constexpr double kRoundingShare = 64;

// Whether a pack may hold the values of all indices up to `last`.
bool isStorable(const TexelRange& range, std::uint32_t last);

// Fits lo and scale to indices up to `last`, of as many bits as that takes, and takes the nearest ones. Sets all of
// `fit`; returns the first index that active voxels may have: 1 where 0 is that of inactive ones.
std::uint32_t fitUniform(const BrickSource& brick, const ActiveValues& active, std::uint32_t last, float* indices,
                         Fit& fit);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_UNIFORM_FIT_H
