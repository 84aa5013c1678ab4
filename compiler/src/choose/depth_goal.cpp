#include "choose/depth_goal.h"

#include "choose/decibels.h"
#include "choose/decode_stored.h"
#include "metric/depth_distortion.h"
#include "metric/depth_error.h"
#include "parallel.h"

namespace billow::compiler {
namespace {

// Of a grid's range. A tighter one costs bytes and a looser one pictures (spec/rationale.md).
constexpr double kVoxelLimit = 0.05;

// Asked for beyond the shortfall (0.02 dB), so that the next measure is likely the last.
constexpr double kStep = 0.9977;

}  // namespace

DepthGoal::DepthGoal(const ImportedGrid& grid, double psnr) : grid_(grid) {
  const DepthError source = measureDepth(grid, grid);
  rmse_ = asked_ = source.range() / amplitudeRatio(psnr);
  lines_ = static_cast<double>(source.lines);
}

double DepthGoal::budget() const {
  return rmse_ * rmse_ * lines_;
}

float DepthGoal::limit() const {
  return static_cast<float>(kVoxelLimit * (static_cast<double>(grid_.max) - static_cast<double>(grid_.min)));
}

bool DepthGoal::holds(std::span<const ChosenBrick> bricks) {
  ImportedGrid result = grid_;
  parallelRanges(bricks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      decodeStored(bricks[i], grid_.leaves[i].active, grid_.background, result.leaves[i].values);
    }
  });
  const double reached = measureDepth(grid_, result).rmse();
  if (reached <= asked_) return true;
  rmse_ *= asked_ / reached * kStep;
  return false;
}

double DepthGoal::distortion(const BrickSource& brick, const Candidate& candidate) {
  format::Values error;
  decodeStored(candidate, *brick.active, brick.tile, error);
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    error[v] = format::maskBit(*brick.active, v) ? error[v] - (*brick.values)[v] : 0;
  }
  return depthDistortion(error);
}

}  // namespace billow::compiler
