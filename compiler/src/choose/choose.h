// The choose stage: every brick of one grid in one frame gets an encoding. Three steps, each a header:
//   trials.h   what each encoding would cost and spoil (in parallel over frames)
//   reuse.h    what the bricks of the frame written before would spoil (serial, in frame order)
//   choose.h   the decision, at a PSNR (here) or at a Lagrange multiplier that a budget gave (size_curve.h)
#ifndef BILLOW_COMPILER_CHOOSE_H
#define BILLOW_COMPILER_CHOOSE_H

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stages.h"

namespace billow::compiler {

enum class Metric {
  voxel,  // active voxels: 20 log10((max - min) / rmse)
  depth,  // line integrals along nine directions: DepthError::psnr()
};

// What the user asks of every grid in every frame. All that are given hold.
struct Quality {
  std::optional<double> psnr = 47.0;  // dB, by the metric
  Metric metric = Metric::voxel;      // depth needs a psnr or a budget
  std::optional<float> maxError;      // largest |reconstructed - source|, in the grid's own unit
  int effort = 1;                     // of the BC7 encoder, 0 to 9
};

// What a byte of each kind weighs in the rate that is traded against error.
struct RateWeights {
  double gpu = 1;
  double disk = 0;
};

// A fixed exchange rate instead of a PSNR: bricks are chosen where distortion + multiplier * rate is least.
struct Exchange {
  double multiplier = 0;  // distortion by the metric, in the grid's own unit, that a byte is worth; > 0
  RateWeights weights;
};

struct ChosenBrick {
  std::uint32_t encoding = format::kEncodingConstant;
  bool texelMask = false;
  float lo = 0;
  float scale = 0;
  std::vector<std::byte> payload;
  double squaredError = 0;  // over active voxels
  float maxError = 0;
  bool reused = false;  // as the frame before holds it
};

struct ChosenGrid {
  std::vector<ChosenBrick> bricks;  // one for each leaf of the imported grid, in its order
  double squaredError = 0;          // over all active voxels (tiles are exact)
  float maxError = 0;
};

// One result for each grid of a frame (empty for those not present), each grid for itself and without an earlier frame.
// `where(grid)` names file, frame and grid in messages. Uses all of TBB's threads; the result does not depend on their
// number. Throws Error(input) when the quality cannot be had, saying what can.
std::vector<ChosenGrid> chooseEncodings(std::span<const ImportedGrid> grids, const Quality& quality,
                                        const std::function<std::string(std::size_t)>& where);

// ---- The decision alone: one point a brick and encoding.

struct Choice {
  std::uint32_t bytes = 0;  // on the GPU: record, payload and stored mask; 0 for what is there already
  double squaredError = 0;  // or what else is traded for bytes, as the metric says
  float maxError = 0;
  std::uint32_t diskBytes = 0;  // an estimate
};

struct Allocation {
  std::vector<std::uint32_t> chosen;  // an index into each brick's choices
  double multiplier = 0;  // squared error that the last byte saved: the Lagrange multiplier; 0: no byte spent
};

// Picks one choice a brick so that the sum of squared errors is at most `budget` at (nearly) the fewest bytes: greedy
// along each brick's lower convex hull, steepest step first, ties by brick number. Choices with maxError above
// `maxError` are not taken. nullopt: not reachable.
std::optional<Allocation> allocate(std::span<const std::vector<Choice>> bricks, double budget, float maxError);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_H
