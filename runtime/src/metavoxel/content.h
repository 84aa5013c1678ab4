// What metavoxels are filled from, as hashes: equal ones mean that what was filled need not be filled again.
#ifndef BILLOW_RUNTIME_METAVOXEL_CONTENT_H
#define BILLOW_RUNTIME_METAVOXEL_CONTENT_H

#include "space.h"

namespace billow::runtime {

// Of where the cells lie. Never 0.
std::uint32_t hashOf(const Space& space);

// Of all that a volume's matter depends on, but not of the view. Low, high.
std::array<std::uint32_t, 2> hashOf(const PlacedVolume& volume, std::uint64_t frameNumber);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_CONTENT_H
