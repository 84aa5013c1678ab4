// The pass that only looks: what a sequence would take at each multiplier.
#ifndef BILLOW_COMPILER_PASSES_SURVEY_H
#define BILLOW_COMPILER_PASSES_SURVEY_H

#include <span>
#include <vector>

#include "choose/size_curve.h"
#include "compile.h"
#include "passes/frames.h"

namespace billow::compiler {

class Survey {
 public:
  // mixes: of the two kinds of bytes; not empty. `options` need not outlive this, `plan` must.
  Survey(const CompileOptions& options, const Plan& plan, std::span<const RateWeights> mixes, const Warn& warn);

  // Square of the range of a grid over the whole sequence, background included (by Metric::depth: of its line
  // integrals); 1 where it is constant. Distortions divided by it are comparable between grids.
  double unit(std::size_t volume, std::size_t grid) const { return grids_[volume][grid].unit(); }
  // Of the whole pack, at a multiplier of such comparable errors. `mix` may lie between two: straight lines.
  PackBytes at(double multiplier, double mix) const;

 private:
  struct Grid {
    double least = 0, most = 0;
    bool seen = false;
    std::vector<SizeCurves> frames;

    void grow(const ImportedGrid& imported, Metric metric);
    double unit() const;
  };

  void look(const FrameWork& frame, const Quality& quality, std::span<const RateWeights> mixes);
  PackBytes atMix(double multiplier, std::size_t mix) const;

  const Plan& plan_;
  std::vector<std::vector<Grid>> grids_;  // by volume
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_PASSES_SURVEY_H
