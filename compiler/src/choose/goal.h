// What one grid in one frame must keep to, and what it trades.
#ifndef BILLOW_COMPILER_CHOOSE_GOAL_H
#define BILLOW_COMPILER_CHOOSE_GOAL_H

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "choose/choose.h"
#include "choose/depth_goal.h"

namespace billow::compiler {

struct Goal {
  std::optional<double> rmse;        // largest root mean square error over active voxels of leaves
  std::shared_ptr<DepthGoal> depth;  // in place of rmse: distortions are of line integrals
  std::optional<Exchange> exchange;  // in place of rmse
  float hardLimit = std::numeric_limits<float>::infinity();  // largest error of a voxel that the user allows
  float limit = std::numeric_limits<float>::infinity();      // the same or less: no voxel goes far astray
  Metric metric = Metric::voxel;                             // what choices' distortions are of
  bool countsDisk = false;                                   // bytes on disk are estimated, which takes time
  bool gpuAlone = false;                                     // the GPU's bytes are all that counts

  bool hasBudget() const { return rmse || depth; }
  // Distortion a squared error of voxels, where errors are uncorrelated.
  double distortionOfNoise() const { return metric == Metric::depth ? DepthGoal::kDistortionOfNoise : 1; }
  // Squared error of voxels that a bit on disk is worth; 0 where no exchange says.
  double bitWorth() const;
  // Squared error (with depth: distortion) that `voxels` of the grid's `all` in leaves may have together; infinite
  // without rmse and depth.
  double errorBudget(std::uint64_t voxels, std::uint64_t all) const;
};

// Where a PSNR or a largest error is asked. `grid` must outlive it.
Goal goalOf(const ImportedGrid& grid, const Quality& quality);
// Where a budget gave the exchange rate; of `quality` the largest error counts.
Goal goalAt(const Exchange& exchange, const Quality& quality);

// With goal.exchange: the choice where squaredError + multiplier * rate is least, of those within the limit, or else
// within the hard one; the first of equal ones. nullopt: there is none.
std::optional<std::uint32_t> cheapest(std::span<const Choice> choices, const Goal& goal);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_GOAL_H
