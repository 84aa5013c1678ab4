// What a brick will take on disk, before it is there.
#ifndef BILLOW_COMPILER_CHOOSE_DISK_ESTIMATE_H
#define BILLOW_COMPILER_CHOOSE_DISK_ESTIMATE_H

#include <cstdint>

#include "stages.h"

namespace billow::compiler {

// Estimated bytes of a candidate in a compressed page: its payload, its node, and its mask where `hasMask`: some voxel
// is inactive, and the mask is stored or coded with the indices. Not of local bricks, which no disk budget takes.
std::uint32_t estimateDiskBytes(const Candidate& candidate, const format::Mask3& active, bool hasMask);
// The same of a uniform brick, from the length of its indices in 1/256 bit.
std::uint32_t diskBytesOfIndices(std::uint32_t bits256, bool hasMask);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_DISK_ESTIMATE_H
