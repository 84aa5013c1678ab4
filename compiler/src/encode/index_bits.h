// What an index costs on disk, as far as that is known before a page is coded.
#ifndef BILLOW_COMPILER_ENCODE_INDEX_BITS_H
#define BILLOW_COMPILER_ENCODE_INDEX_BITS_H

#include <cstdint>

#include "encode/index_walk.h"

namespace billow::compiler {

// log2(value) in 1/256 bit, rounded down; value > 0. Integer arithmetic: the same everywhere.
std::uint32_t log2In256ths(std::uint32_t value);

// Code length of `index`, in 1/256 bit, where it was foretold so: that of a probability which falls with the distance
// from the guess, as it does in the mean over real smoke and fire, and sums to 1 over the range.
std::uint32_t indexBits256(const IndexGuess& guess, IndexRange range, std::int32_t index);

// Of all active voxels' indices, by voxelIndex.
std::uint32_t indicesBits256(const format::Texels& indices, const format::Mask3& active, IndexRange range);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_INDEX_BITS_H
