// Bricks that weigh little on disk for their error: steps and indices are chosen for both.
#ifndef BILLOW_COMPILER_ENCODE_ENCODE_FOR_DISK_H
#define BILLOW_COMPILER_ENCODE_ENCODE_FOR_DISK_H

#include <cstdint>
#include <limits>

#include "stages.h"

namespace billow::compiler {

struct DiskUniform {
  std::uint32_t last;   // largest index, 1 to 255; the brick has the bits that this takes
  double bitWorth = 0;  // squared error that a bit on disk is worth; 0: what suits the step that `last` gives
  float limit = std::numeric_limits<float>::infinity();  // no value is moved farther than this to save bits
};

// A uniform brick, each index of which is where error and bits together are least. Fills `out` whole; returns the
// estimated length of the indices on disk, in 1/256 bit. Deterministic, thread-safe, no allocation.
std::uint32_t encodeUniformForDisk(const BrickSource& brick, const DiskUniform& wanted, Candidate& out);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_ENCODE_FOR_DISK_H
