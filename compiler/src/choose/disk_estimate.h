// What a brick will take on disk, before it is there.
#ifndef BILLOW_COMPILER_CHOOSE_DISK_ESTIMATE_H
#define BILLOW_COMPILER_CHOOSE_DISK_ESTIMATE_H

#include <cstdint>
#include <span>

#include "stages.h"

namespace billow::compiler {

// log2(value) in 1/256 bit, rounded down; value > 0. Integer arithmetic: the same everywhere.
std::uint32_t log2In256ths(std::uint32_t value);

// Order-0 entropy of symbols with these counts, in bytes, rounded up.
std::uint32_t entropyBytes(std::span<const std::uint32_t> counts);

// Estimated bytes of a candidate in a compressed page: its payload, its mask where one is stored, and its node.
std::uint32_t estimateDiskBytes(const Candidate& candidate, const format::Mask3& active, bool storesMask);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_DISK_ESTIMATE_H
