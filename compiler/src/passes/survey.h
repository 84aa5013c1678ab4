// The pass that only looks: what a sequence would take at each multiplier.
#ifndef BILLOW_COMPILER_PASSES_SURVEY_H
#define BILLOW_COMPILER_PASSES_SURVEY_H

#include <vector>

#include "choose/size_curve.h"
#include "compile.h"
#include "passes/frames.h"

namespace billow::compiler {

class Survey {
 public:
  Survey(const CompileOptions& options, const Plan& plan, const RateWeights& weights, const Warn& warn);

  // Square of the range of a grid over the whole sequence, background included; 1 where it is constant. Squared errors
  // divided by it are comparable between grids.
  double unit(std::size_t volume, std::size_t grid) const { return grids_[volume][grid].unit(); }
  // Of the whole pack, at a multiplier of such comparable errors.
  PackBytes at(double multiplier) const;

 private:
  struct Grid {
    float min = 0, max = 0;
    bool seen = false;
    std::vector<SizeCurve> frames;

    void grow(const ImportedGrid& imported);
    double unit() const;
  };

  void look(const FrameWork& frame, const Quality& quality, const RateWeights& weights);

  const Plan& plan_;
  std::vector<std::vector<Grid>> grids_;  // by volume
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_PASSES_SURVEY_H
