#include "passes/survey.h"

#include <algorithm>

namespace billow::compiler {
namespace {

// Header, contents, strings and settings.
constexpr double kContainerBytes = 1536;

}  // namespace

void Survey::Grid::grow(const ImportedGrid& imported) {
  min = seen ? std::min(min, imported.min) : imported.min;
  max = seen ? std::max(max, imported.max) : imported.max;
  seen = true;
}

double Survey::Grid::unit() const {
  const double range = static_cast<double>(max) - static_cast<double>(min);
  return range > 0 ? range * range : 1;
}

Survey::Survey(const CompileOptions& options, const Plan& plan, const RateWeights& weights, const Warn& warn)
    : plan_(plan) {
  for (const PlannedVolume& volume : plan.volumes) grids_.emplace_back(volume.grids.size());
  const std::size_t total = frameCount(plan);
  std::size_t done = 0;
  if (options.progress) options.progress(done, total);
  Goal goal;  // no error and no exchange: all is tried that the pass which writes may take
  goal.countsDisk = weights.disk > 0;
  goal.gpuAlone = !goal.countsDisk;
  const auto everything = [&](const Job&, std::size_t, const ImportedGrid&) { return goal; };
  runFrames({plan, options.import, options.quality.effort, warn, everything, [&](const FrameWork& frame) {
               look(frame, options.quality, weights);
               if (options.progress) options.progress(++done, total);
             }});
}

void Survey::look(const FrameWork& frame, const Quality& quality, const RateWeights& weights) {
  for (std::size_t g = 0; g < frame.grids.size(); ++g) {
    Grid& grid = grids_[frame.job.volume][g];
    const ImportedGrid& imported = frame.imported.grids[g];
    const GridWork& work = frame.grids[g];
    if (imported.present) grid.grow(imported);
    if (work.isNew) {
      grid.frames.emplace_back(imported, work.trials.get(), work.unchanged, quality, weights,
                               whereIs(plan_, frame.job, g));
    }
  }
}

PackBytes Survey::at(double multiplier) const {
  PackBytes sum{0, kContainerBytes};
  for (std::size_t v = 0; v < grids_.size(); ++v) {
    const double frames = static_cast<double>(plan_.volumes[v].frames.size());
    sum.disk += frames * static_cast<double>(sizeof(format::FrameRecord));
    for (const Grid& grid : grids_[v]) {
      sum.disk += frames * static_cast<double>(sizeof(format::GridFrame));
      for (const SizeCurve& frame : grid.frames) {
        const PackBytes bytes = frame.at(multiplier * grid.unit());
        sum.gpu += bytes.gpu;
        sum.disk += bytes.disk;
      }
    }
  }
  return sum;
}

}  // namespace billow::compiler
