// A brick's voxels on their way to blocks and back to errors: loops over all of them, with what SIMD the machine has
// and the same bits on every one.
#ifndef BILLOW_COMPILER_ENCODE_BRICK_LANES_H
#define BILLOW_COMPILER_ENCODE_BRICK_LANES_H

#include <cstdint>

#include "encode/texel_range.h"

namespace billow::compiler {

// Of the active voxels; both 0 where none is active.
ValueRange activeRange(const BrickSource& brick);
// Clamped to [first, last]; inactive voxels are `first`.
void texelTargets(const BrickSource& brick, TexelRange range, std::uint32_t first, std::uint32_t last,
                  TexelTargets& targets);
void texelWeights(const BrickSource& brick, TexelWeights& weights);
// Sets squaredError and maxError from what the reader will reconstruct from `texels`.
void measure(const BrickSource& brick, const format::Texels& texels, Candidate& candidate);

// What every block encoding of a brick starts from.
struct BrickTargets {
  explicit BrickTargets(const BrickSource& brick);
  BrickTargets(const BrickSource& brick, TexelRange texelRange);

  TexelRange range;
  TexelTargets value;
  TexelWeights weight;  // unset where allActive
  bool allActive;
};

// A brick on its texel scale with an axis exchanged with z, as [c][i][block]: texel i of a 4x4 block at column block &
// 1 and row block >> 1 & 1 of slice z = 4 * (block >> 2) + c. So c is a channel of eight BC7 blocks.
struct BlockTexels {
  alignas(32) float value[4][16][8];   // in [0, 255]
  alignas(32) float weight[4][16][8];  // 0 or 1; unset where allActive
  bool allActive;
};
void arrange(const BrickTargets& targets, std::uint32_t packedAxis, BlockTexels& texels);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_BRICK_LANES_H
