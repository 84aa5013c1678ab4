#include "passes/survey.h"

#include <algorithm>

#include "metric/depth_error.h"

namespace billow::compiler {
namespace {

// Header, contents, strings and settings.
constexpr double kContainerBytes = 1536;

}  // namespace

void Survey::Grid::grow(const ImportedGrid& imported, Metric metric) {
  auto low = static_cast<double>(imported.min), high = static_cast<double>(imported.max);
  if (metric == Metric::depth) {
    const DepthError source = measureDepth(imported, imported);
    low = source.leastIntegral;
    high = source.largestIntegral;
  }
  least = seen ? std::min(least, low) : low;
  most = seen ? std::max(most, high) : high;
  seen = true;
}

double Survey::Grid::unit() const {
  const double range = most - least;
  return range > 0 ? range * range : 1;
}

Survey::Survey(const CompileOptions& options, const Plan& plan, std::span<const RateWeights> mixes, const Warn& warn)
    : plan_(plan) {
  for (const PlannedVolume& volume : plan.volumes) grids_.emplace_back(volume.grids.size());
  const std::size_t total = frameCount(plan);
  std::size_t done = 0;
  if (options.progress) options.progress(done, total);
  Goal goal;  // no error and no exchange: all is tried that the pass which writes may take
  goal.countsDisk = std::any_of(mixes.begin(), mixes.end(), [](const RateWeights& w) { return w.disk > 0; });
  goal.gpuAlone = !goal.countsDisk;
  goal.metric = options.quality.metric;
  if (options.quality.maxError) goal.hardLimit = *options.quality.maxError;
  const auto everything = [&](const Job&, std::size_t, const ImportedGrid&) { return goal; };
  runFrames({plan, options.import, options.quality.effort, warn, everything, [&](const FrameWork& frame) {
               look(frame, options.quality, mixes);
               if (options.progress) options.progress(++done, total);
             }});
}

void Survey::look(const FrameWork& frame, const Quality& quality, std::span<const RateWeights> mixes) {
  for (std::size_t g = 0; g < frame.grids.size(); ++g) {
    Grid& grid = grids_[frame.job.volume][g];
    const ImportedGrid& imported = frame.imported.grids[g];
    const GridWork& work = frame.grids[g];
    if (work.isNew) grid.grow(imported, quality.metric);
    if (work.isNew) {
      grid.frames.emplace_back(imported, work.trials.get(), work.unchanged, quality, mixes,
                               whereIs(plan_, frame.job, g));
    }
  }
}

PackBytes Survey::atMix(double multiplier, std::size_t mix) const {
  PackBytes sum{0, kContainerBytes};
  for (std::size_t v = 0; v < grids_.size(); ++v) {
    const double frames = static_cast<double>(plan_.volumes[v].frames.size());
    sum.disk += frames * static_cast<double>(sizeof(format::FrameRecord));
    for (const Grid& grid : grids_[v]) {
      sum.disk += frames * static_cast<double>(sizeof(format::GridFrame));
      for (const SizeCurves& frame : grid.frames) {
        const PackBytes bytes = frame.at(multiplier * grid.unit(), mix);
        sum.gpu += bytes.gpu;
        sum.disk += bytes.disk;
      }
    }
  }
  return sum;
}

PackBytes Survey::at(double multiplier, double mix) const {
  const auto before = static_cast<std::size_t>(mix);
  const PackBytes from = atMix(multiplier, before);
  const double fraction = mix - static_cast<double>(before);
  if (!(fraction > 0)) return from;
  const PackBytes to = atMix(multiplier, before + 1);
  return {from.gpu + fraction * (to.gpu - from.gpu), from.disk + fraction * (to.disk - from.disk)};
}

}  // namespace billow::compiler
