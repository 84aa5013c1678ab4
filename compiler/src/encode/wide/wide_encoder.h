// The encoders' hot loops, which take a whole brick at a time, eight blocks side by side. They exist once for every
// machine and once for machines with AVX2; both give the same bits.
#ifndef BILLOW_COMPILER_ENCODE_WIDE_ENCODER_H
#define BILLOW_COMPILER_ENCODE_WIDE_ENCODER_H

#include <cstddef>
#include <cstdint>
#include <span>

#include "encode/texel_range.h"

namespace billow::compiler {

// What every block encoding of a brick starts from.
struct BrickTargets {
  explicit BrickTargets(const BrickSource& brick);

  TexelRange range;
  TexelTargets value;
  TexelWeights weight;  // unset where allActive
  bool allActive;
};

// A brick on its texel scale with an axis exchanged with z, as [c][i][lane]: texel i of a 4x4 block at column lane & 1
// and row lane >> 1 & 1 of slice z = 4 * (lane >> 2) + c. So lane is a BC7 block and c its channel, and each c holds
// eight BC4 blocks.
struct WideBrick {
  alignas(32) float value[4][16][8];   // in [0, 255]
  alignas(32) float weight[4][16][8];  // 0 or 1; unset where allActive
  bool allActive;
};

// BC7's mode 6 for the eight blocks of a brick, by lane.
struct WideMode6 {
  alignas(32) float first[4][8];  // ends by channel, as the decoder expands them
  alignas(32) float second[4][8];
  alignas(32) float step[16][8];  // of [0, 15]
  alignas(32) float error[8];     // squared, in texel units
};

struct WideEncoder {
  // Of the active voxels; both 0 where none is active.
  ValueRange (*activeRange)(const BrickSource& brick);
  // Clamped to [first, last]; inactive voxels are `first`.
  void (*texelTargets)(const BrickSource& brick, TexelRange range, std::uint32_t first, std::uint32_t last,
                       TexelTargets& targets);
  void (*texelWeights)(const BrickSource& brick, TexelWeights& weights);
  // Sets squaredError and maxError from what the reader will reconstruct from `texels`.
  void (*measure)(const BrickSource& brick, const format::Texels& texels, Candidate& candidate);
  void (*arrange)(const BrickTargets& targets, std::uint32_t packedAxis, WideBrick& wide);
  // Sum over the BC4 blocks of the square of their range, which BC4's error follows.
  float (*bc4Spread)(const WideBrick& wide);
  // Fits and writes all 32 blocks, 256 bytes.
  void (*encodeBc4)(const WideBrick& wide, std::byte* payload);
  // `passes` of least squares and requantisation. Returns the sum of errors.
  float (*fitMode6)(const WideBrick& wide, int passes, WideMode6& fit);
};

// All that this machine can run, the fastest first.
std::span<const WideEncoder* const> wideEncoders();
// The fastest.
const WideEncoder& wideEncoder();

namespace baseline {
extern const WideEncoder kWideEncoder;
}
namespace avx2 {
extern const WideEncoder kWideEncoder;
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_WIDE_ENCODER_H
