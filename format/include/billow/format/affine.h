// The 3x4 row-major transforms of a pack: one word on which of them can be turned round.
#ifndef BILLOW_FORMAT_AFFINE_H
#define BILLOW_FORMAT_AFFINE_H

#include <span>

namespace billow::format {

// Of the left 3x3 part, expanded along the first row. Its magnitude is the world volume of one voxel.
double determinant(const double (&m)[12]);

// Rule 217: all twelve numbers, the determinant and the determinant's reciprocal are finite.
bool invertible(const double (&m)[12]);

// Index from world, by Cramer's rule; `m` must be invertible(). A coefficient beyond a double becomes infinite.
void invert(const double (&m)[12], double (&inverse)[12]);

// What `inner` and then `outer` do.
void compose(std::span<const double, 12> outer, const double (&inner)[12], double (&product)[12]);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_AFFINE_H
