// BC7 blocks, the eight of a brick at a time: the modes that can carry four free channels (4, 5, 6 and 7).
#ifndef BILLOW_COMPILER_ENCODE_BC7_BLOCK_H
#define BILLOW_COMPILER_ENCODE_BC7_BLOCK_H

#include <cstddef>
#include <cstdint>

#include "encode/brick_lanes.h"

namespace billow::compiler {

// The blocks of a brick as they will be stored, by block in the last index. Integers, as floats for the sake of SIMD.
struct Bc7Fits {
  alignas(32) float mode[8];
  float partition[8];      // mode 7
  float rotation[8];       // modes 4 and 5: channel rotation - 1 has changed places with channel 3
  float colorIsSecond[8];  // mode 4: 1 where colour has the three-bit steps
  float first[2][4][8];    // ends by subset and channel, as the decoder expands them to eight bits; modes 4 and 5 keep
  float second[2][4][8];   // the separate channel in channel 3
  float step[16][8];       // of all texels; modes 4 and 5: of the three colour channels
  float separateStep[16][8];
  float error[8];  // squared, in texel units
};

// How much is tried. The higher an effort, the more.
struct Bc7Search {
  int passes = 1;          // of least squares and requantisation
  int starts = 1;          // first guesses at a line, at most 4
  int rotations = 0;       // modes 4 and 5: none, the channel that mode 6 serves worst, or all four
  int ranked = 0;          // partitions of mode 7 that are compared, at most 64
  int partitions = 0;      // of those that are tried, the most promising first, at most 32
  int nudges = 0;          // rounds of moving each end by single steps
  bool mode5 = false;      // else mode 4 alone, which serves nearly as well
  bool allPBits = false;   // every combination, not just the nearest
  bool everyAxis = false;  // all modes for each packed axis, not just for the one that mode 6 serves best
  int ranges = 0;          // rounds of solving the brick's lo and scale and encoding again
};
// `effort` in [0, 9]; others are clamped.
Bc7Search bc7Search(int effort);

// Mode 6 replaces all of `fits`; the others replace what they better.
void fitMode6(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits);
void tryModes4And5(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits);
void tryMode7(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits);

// Writes 16 bytes.
void packBlock(const Bc7Fits& fits, std::uint32_t block, std::byte* bytes);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_BC7_BLOCK_H
