// What metavoxels are filled from, as hashes: equal ones mean that what was filled need not be filled again.
#ifndef BILLOW_RUNTIME_METAVOXEL_CONTENT_H
#define BILLOW_RUNTIME_METAVOXEL_CONTENT_H

#include "space.h"

namespace billow::runtime {

// Of where the cells lie. Never 0.
std::uint32_t hashOf(const Space& space);

// Of all that a layer's matter depends on, but not of the view. Low, high; those of several layers add.
std::array<std::uint32_t, 2> hashOf(const PlacedLayer& layer, std::uint64_t frameNumber);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_CONTENT_H
