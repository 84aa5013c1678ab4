#include "choose/goal.h"

#include <algorithm>
#include <cmath>

#include "choose/decibels.h"

namespace billow::compiler {
namespace {

// Mean error alone would let single voxels go far astray in bricks that are otherwise quiet. So no voxel's error may
// exceed this many times the root mean square error that the PSNR allows (at 47 dB: 2.2 % of the range). Pictures of
// thin haze, where rays meet few voxels, gain most by it (spec/rationale.md).
constexpr double kOutlierLimit = 5;

// A uniform quantiser of b bits has a mean square error d that falls by 2 ln 2 d a bit; a byte is 8 / 512 bit for each
// of 512 voxels, so it saves 16 ln 2 d of squared error. Backwards, a multiplier tells the error it goes with.
constexpr double kErrorsPerMultiplier = 11.09035489;  // 16 ln 2

}  // namespace

double Goal::errorBudget(std::uint64_t voxels, std::uint64_t all) const {
  if (depth) return all == 0 ? 0 : depth->budget() * (static_cast<double>(voxels) / static_cast<double>(all));
  if (!rmse) return std::numeric_limits<double>::infinity();
  return *rmse * *rmse * static_cast<double>(voxels) * (1 - 1e-6);
}

double Goal::bitWorth() const {
  return exchange ? exchange->multiplier * exchange->weights.disk / 8 / distortionOfNoise() : 0;
}

Goal goalOf(const ImportedGrid& grid, const Quality& quality) {
  Goal goal;
  goal.metric = quality.metric;
  if (quality.maxError) goal.limit = goal.hardLimit = *quality.maxError;
  if (quality.metric == Metric::depth) {
    goal.depth = std::make_shared<DepthGoal>(grid, *quality.psnr);
    goal.limit = goal.hardLimit = std::min(goal.limit, goal.depth->limit());
  } else if (quality.psnr) {
    goal.rmse = (static_cast<double>(grid.max) - static_cast<double>(grid.min)) / amplitudeRatio(*quality.psnr);
    goal.limit = std::min(goal.limit, static_cast<float>(kOutlierLimit * *goal.rmse));
    goal.hardLimit = goal.limit;
  }
  return goal;
}

Goal goalAt(const Exchange& exchange, const Quality& quality) {
  Goal goal;
  goal.exchange = exchange;
  goal.metric = quality.metric;
  goal.countsDisk = exchange.weights.disk > 0;
  goal.gpuAlone = !goal.countsDisk;
  if (quality.maxError) goal.hardLimit = *quality.maxError;
  const double squaredErrorPerByte =
      exchange.multiplier * (exchange.weights.gpu + exchange.weights.disk) / goal.distortionOfNoise();
  const double rmse = std::sqrt(squaredErrorPerByte / kErrorsPerMultiplier);
  goal.limit = std::min(goal.hardLimit, static_cast<float>(kOutlierLimit * rmse));
  return goal;
}

std::optional<std::uint32_t> cheapest(std::span<const Choice> choices, const Goal& goal) {
  for (const float limit : {goal.limit, goal.hardLimit}) {
    std::optional<std::uint32_t> best;
    double least = 0;
    for (std::uint32_t i = 0; i < choices.size(); ++i) {
      const Choice& choice = choices[i];
      if (choice.maxError > limit) continue;
      const RateWeights& weights = goal.exchange->weights;
      const double rate = weights.gpu * choice.bytes + weights.disk * choice.diskBytes;
      const double cost = choice.squaredError + goal.exchange->multiplier * rate;
      if (best && cost >= least) continue;
      best = i;
      least = cost;
    }
    if (best) return best;
  }
  return std::nullopt;
}

}  // namespace billow::compiler
