// What a grid must keep to where its error is that of depth (Metric::depth), and the proof that it does.
#ifndef BILLOW_COMPILER_CHOOSE_DEPTH_GOAL_H
#define BILLOW_COMPILER_CHOOSE_DEPTH_GOAL_H

#include <span>

#include "choose/choose.h"

namespace billow::compiler {

class DepthGoal {
 public:
  // `psnr` as DepthError::psnr() is to reach it. `grid` must outlive this.
  DepthGoal(const ImportedGrid& grid, double psnr);

  // What distortions of all bricks may add up to.
  double budget() const;
  // Largest error of a voxel, in the grid's unit: rays that pass few voxels, close up and through haze, see single
  // ones.
  float limit() const;
  // Measures the finished grid. Where it falls short, as bricks' errors may add up along lines, asks for that much more
  // and returns false.
  bool holds(std::span<const ChosenBrick> bricks);

  // depthDistortion() of a candidate, by the very decoder that readers have.
  static double distortion(const BrickSource& brick, const Candidate& candidate);

  // Distortion a squared error of voxels, where errors are uncorrelated: the squares of the nine directions' steps.
  static constexpr double kDistortionOfNoise = 3 * 1 + 6 * 2;

 private:
  const ImportedGrid& grid_;
  double asked_;  // rmse of line integrals that the PSNR means
  double rmse_;   // of line integrals, that the allocator is asked for
  double lines_;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_DEPTH_GOAL_H
