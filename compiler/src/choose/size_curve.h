// What a budget is fitted with: a grid frame's bytes at each Lagrange multiplier of a fixed ladder. That is all that is
// kept of a grid frame between the pass that surveys a sequence and the one that writes it.
#ifndef BILLOW_COMPILER_CHOOSE_SIZE_CURVE_H
#define BILLOW_COMPILER_CHOOSE_SIZE_CURVE_H

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "choose/choose.h"
#include "choose/trials.h"

namespace billow::compiler {

// The ladder: multipliers 2^(position / 4), straight lines between whole positions, so that every build computes the
// same numbers. positionOf is its inverse; multiplier > 0.
double ladderMultiplier(double position);
double positionOf(double multiplier);

struct PackBytes {
  double gpu = 0;
  double disk = 0;
};

// Curves for several weights of the two kinds of bytes.
class SizeCurves {
 public:
  // Of the leaves that were tried; skipped ones cost nothing. trials: null where there is no leaf. mixes: the weights
  // of the rate that will be traded, one curve each.
  SizeCurves(const ImportedGrid& grid, const GridTrials* trials, std::span<const char> skip, const Quality& quality,
             std::span<const RateWeights> mixes, const std::string& where);

  // At a multiplier in the grid's own unit, by the curve of a mix; the ends go on level.
  PackBytes at(double multiplier, std::size_t mix) const;

 private:
  int first_ = 0;                              // position of the first step
  std::vector<std::vector<PackBytes>> steps_;  // by mix
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_SIZE_CURVE_H
