#include "choose/size_curve.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "billow/format/gpu_size.h"
#include "parallel.h"
#include "share/share.h"

namespace billow::compiler {
namespace {

constexpr int kStepsPerOctave = 4;
constexpr std::array<double, 5> kOctave = {1, 1.189207115002721, 1.4142135623730951, 1.681792830507429, 2};

// Below the first step 16 bits a voxel pay even in bricks that span a thousandth of the grid's range; above the last
// nothing but a constant pays. Both from the square of the range, or from the distortion that noise of it would have.
constexpr int kFirstOctave = -46;
constexpr int kLastOctave = 6;

// On disk: a Node4 with its mask and a Node5, compressed.
constexpr double kNode4DiskBytes = 120;
constexpr double kNode5DiskBytes = 120;

// The grid frame's size but for its bricks and masks: what the index and the nodes need, sharing left out.
format::GridFrame shape(const ImportedGrid& grid, const std::string& where) {
  format::GridFrame frame{};
  std::array<std::int64_t, 3> min, max;
  activeBox(grid, min, max);
  const std::array<std::int32_t, 3> origin = chooseOrigin(min, max, where);
  for (std::size_t a = 0; a < 3; ++a) {
    frame.activeMin[a] = static_cast<std::int32_t>(min[a] - origin[a]);
    frame.activeMax[a] = static_cast<std::int32_t>(max[a] - origin[a]);
  }
  std::set<std::array<std::int32_t, 3>> nodes4;
  const auto add = [&](const std::array<std::int32_t, 3>& at) { nodes4.insert({at[0] >> 7, at[1] >> 7, at[2] >> 7}); };
  for (const Leaf& leaf : grid.leaves) add(leaf.origin);
  for (const Tile& tile : grid.tiles) add(tile.origin);
  frame.node3Count = static_cast<std::uint32_t>(grid.leaves.size() + grid.tiles.size());
  frame.node4Count = static_cast<std::uint32_t>(nodes4.size());
  frame.childCount = frame.node3Count + frame.node4Count;
  return frame;
}

PackBytes sizeAt(const GridTrials* trials, const Goal& goal, format::GridFrame frame) {
  std::uint64_t disk = 0;
  for (std::size_t i = 0; trials != nullptr && i < trials->choices().size(); ++i) {
    const auto choice = cheapest(trials->choices()[i], goal);
    if (!choice) continue;  // skipped
    disk += trials->choices()[i][*choice].diskBytes;
    format::countBrick(frame, trials->fits(i)[*choice].encoding);
    frame.maskCount += trials->storesMask(i, *choice) ? 1 : 0;
  }
  const double nodes = kNode5DiskBytes + kNode4DiskBytes * frame.node4Count;
  return {static_cast<double>(format::gpuBytes(frame).total()), static_cast<double>(disk) + nodes};
}

}  // namespace

double ladderMultiplier(double position) {
  const double octave = std::floor(position / kStepsPerOctave);
  const double within = position - octave * kStepsPerOctave;
  const auto step = std::min(static_cast<std::size_t>(within), std::size_t{kStepsPerOctave - 1});
  const double fraction = within - static_cast<double>(step);
  return std::ldexp(kOctave[step] + fraction * (kOctave[step + 1] - kOctave[step]), static_cast<int>(octave));
}

double positionOf(double multiplier) {
  int exponent = 0;
  const double mantissa = 2 * std::frexp(multiplier, &exponent);  // [1, 2)
  std::size_t step = 0;
  while (step + 1 < kStepsPerOctave && mantissa >= kOctave[step + 1]) ++step;
  const double fraction = (mantissa - kOctave[step]) / (kOctave[step + 1] - kOctave[step]);
  return (exponent - 1) * kStepsPerOctave + static_cast<double>(step) + fraction;
}

SizeCurves::SizeCurves(const ImportedGrid& grid, const GridTrials* trials, std::span<const char> skip,
                       const Quality& quality, std::span<const RateWeights> mixes, const std::string& where) {
  if (grid.leaves.empty() && grid.tiles.empty()) {
    steps_.assign(mixes.size(), std::vector<PackBytes>(1));
    return;
  }
  const double range = static_cast<double>(grid.max) - static_cast<double>(grid.min);
  const double noise = quality.metric == Metric::depth ? DepthGoal::kDistortionOfNoise : 1;
  const int top = static_cast<int>(std::floor(positionOf(range > 0 ? range * range * noise : 1)));
  first_ = top + kFirstOctave * kStepsPerOctave;
  constexpr std::size_t kSteps = (kLastOctave - kFirstOctave) * kStepsPerOctave + 1;
  steps_.assign(mixes.size(), std::vector<PackBytes>(kSteps));
  const format::GridFrame frame = shape(grid, where);
  const auto known = static_cast<std::uint64_t>(std::count(skip.begin(), skip.end(), '\1'));
  parallelRanges(kSteps * mixes.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s != end; ++s) {
      const Exchange exchange{ladderMultiplier(first_ + static_cast<int>(s % kSteps)), mixes[s / kSteps]};
      PackBytes& bytes = steps_[s / kSteps][s % kSteps];
      bytes = sizeAt(trials, goalAt(exchange, quality), frame);
      bytes.gpu -= static_cast<double>(known * format::kGpuRecordBytes);
    }
  });
}

PackBytes SizeCurves::at(double multiplier, std::size_t mix) const {
  const std::vector<PackBytes>& steps = steps_[mix];
  const double place = std::clamp(positionOf(multiplier) - first_, 0.0, static_cast<double>(steps.size() - 1));
  const auto step = static_cast<std::size_t>(place);
  const PackBytes& from = steps[step];
  const PackBytes& to = steps[std::min(step + 1, steps.size() - 1)];
  const double fraction = place - static_cast<double>(step);
  return {from.gpu + fraction * (to.gpu - from.gpu), from.disk + fraction * (to.disk - from.disk)};
}

}  // namespace billow::compiler
