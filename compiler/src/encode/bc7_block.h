// One BC7 block: the modes that can carry four free channels (4, 5, 6 and 7), tried in order of their price.
#ifndef BILLOW_COMPILER_ENCODE_BC7_BLOCK_H
#define BILLOW_COMPILER_ENCODE_BC7_BLOCK_H

#include <cstddef>
#include <cstdint>

#include "encode/bc7_plane.h"

namespace billow::compiler {

// A block as it will be stored. Ends of lines are the 8-bit values to which the decoder expands the stored ones.
struct Bc7Fit {
  std::uint32_t mode = 6;
  std::uint32_t partition = 0;  // mode 7
  std::uint32_t rotation = 0;   // modes 4 and 5: channel rotation - 1 has changed places with channel 3
  bool colorIsSecond = false;   // mode 4: colour has the three-bit steps
  Line line[2] = {};            // by subset; modes 4 and 5 keep the separate channel in lane 3
  Steps steps = {};             // of all texels; modes 4 and 5: of the three colour channels
  Steps separateSteps = {};     // modes 4 and 5
  float error = 1e30f;          // squared, in texel units
};

// How much is tried. The higher an effort, the more.
struct Bc7Search {
  int passes = 2;          // of least squares and requantisation
  int rotations = 0;       // modes 4 and 5: none, the channel that mode 6 serves worst, or all four
  int ranked = 0;          // partitions of mode 7 that are compared: the first so many, a multiple of 4, at most 64
  int partitions = 0;      // of those that are tried, the most promising first
  bool mode4 = false;      // else mode 5 alone
  bool allPBits = false;   // every combination, not just the nearest
  bool nudge = false;      // each end of mode 6 by single steps
  bool everyAxis = false;  // all modes for each packed axis, not just for the one that mode 6 serves best
};
// `effort` in [0, 5]; others are clamped.
Bc7Search bc7Search(int effort);

Bc7Fit fitMode6(const Plane& plane, const Bc7Search& search);
// Replaces `best` where another mode has a smaller error.
void tryOtherModes(const Plane& plane, const Bc7Search& search, Bc7Fit& best);
void tryModes4And5(const Plane& plane, const Bc7Search& search, Bc7Fit& best);
void tryMode7(const Plane& plane, const Bc7Search& search, Bc7Fit& best);

// Writes 16 bytes.
void packBlock(const Bc7Fit& fit, std::byte* block);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_BC7_BLOCK_H
