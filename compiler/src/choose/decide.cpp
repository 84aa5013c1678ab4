#include "choose/decide.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "billow/format/gpu_size.h"
#include "metric/depth_distortion.h"
#include "parallel.h"

namespace billow::compiler {
namespace {

// A stored brick takes no room in the pack, but on the GPU a frame holds it like any other. So where a frame has an
// error to keep to, it counts for half of its size: measured on real smoke and fire (spec/rationale.md), that saves
// nearly all that free bricks would, and no frame grows by more than 1.3 %.
constexpr std::uint32_t kReuseDivisor = 2;

// Bytes of the smallest brick that is no constant.
constexpr std::uint32_t kSmallestBrick = 64;

// A brick that stands still is stored anew only where its error has become this many times what a new brick's bytes are
// worth: the balance of a frame moves with what else is in it, and should not store again what has not changed.
constexpr double kRetryGain = 4;

class Decision {
 public:
  Decision(const ImportedGrid& grid, const Goal& goal, GridTrials& trials, const std::string& where)
      : grid_(grid), goal_(goal), trials_(trials), where_(where) {}

  void offerStored(const FrameBefore& before, std::span<const char> unchanged) {
    const std::vector<const ChosenBrick*> stored = before.candidates(grid_);
    std::vector<Fit> fits(stored.size());
    std::vector<Choice> choices(stored.size());
    unchanged_.assign(stored.size(), 0);
    parallelRanges(stored.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i) {
        if (stored[i] == nullptr) continue;
        unchanged_[i] = i < unchanged.size() ? unchanged[i] : '\0';
        fits[i] = measure(i, *stored[i], choices[i]);
      }
    });
    for (std::size_t i = 0; i < stored.size(); ++i) {
      if (stored[i] != nullptr) trials_.offer(i, *stored[i], fits[i], choices[i]);
    }
  }

  ChosenGrid choose() {
    ChosenGrid result = take(goal_.exchange ? chooseAtExchange() : chooseAtError());
    while (goal_.depth && !goal_.depth->holds(result.bricks)) result = take(chooseAtError());
    return result;
  }

 private:
  Fit measure(std::size_t i, const ChosenBrick& stored, Choice& choice) const {
    Fit fit{stored.encoding, stored.texelMask, stored.lo, stored.scale, stored.squaredError, stored.maxError};
    format::Values errors;
    const bool depth = goal_.metric == Metric::depth;
    if (unchanged_[i] == 0 || depth) fit = measureReuse(stored, grid_.leaves[i], grid_.background, errors);
    const double distortion = depth ? depthDistortion(errors) : fit.squaredError;
    choice = {goal_.exchange ? 0 : sizeOf(i, stored) / kReuseDivisor, distortion, fit.maxError};
    return fit;
  }

  std::uint32_t sizeOf(std::size_t i, const ChosenBrick& brick) const {
    const bool mask = trials_.activeVoxels(i) != format::kBrickVoxels && !brick.texelMask;
    return static_cast<std::uint32_t>(brick.payload.size() + (mask ? sizeof(format::Mask3) : 0) +
                                      format::kGpuRecordBytes);
  }

  ChosenGrid take(const std::vector<std::uint32_t>& chosen) const {
    ChosenGrid result;
    result.bricks.resize(chosen.size());
    parallelRanges(chosen.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i) result.bricks[i] = trials_.take(i, chosen[i]);
    });
    for (const ChosenBrick& brick : result.bricks) {
      result.squaredError += brick.squaredError;
      result.maxError = std::max(result.maxError, brick.maxError);
    }
    return result;
  }

  std::vector<std::uint32_t> chooseAtExchange() const {
    std::vector<std::uint32_t> chosen;
    chosen.reserve(grid_.leaves.size());
    for (const std::vector<Choice>& choices : trials_.choices()) {
      const auto choice = cheapest(choices, goal_);
      if (!choice) throwOutOfReach();
      chosen.push_back(*choice);
    }
    return chosen;
  }

  std::vector<std::uint32_t> chooseAtError() {
    auto chosen = solve();
    if (retry(chosen)) chosen = solve();
    if (!chosen) {
      trials_.tryWide();
      chosen = solve();
    }
    if (!chosen) throwOutOfReach();
    return std::move(chosen->chosen);
  }

  std::optional<Allocation> solve() const {
    const std::uint64_t voxels = trials_.activeVoxels();
    return allocate(trials_.choices(), goal_.errorBudget(voxels, voxels), goal_.limit);
  }

  // Tries those unchanged leaves after all where a new brick might win: it costs more bytes than the stored one did,
  // which was the best then, and saves at most the stored one's error.
  bool retry(const std::optional<Allocation>& chosen) {
    std::vector<char> again(unchanged_.size());
    for (std::size_t i = 0; i < again.size(); ++i) {
      if (unchanged_[i] == 0) continue;
      const std::uint32_t bytes = std::max(kSmallestBrick, *format::brickBytes(trials_.fits(i).back().encoding));
      const double worth = chosen ? kRetryGain * chosen->multiplier * bytes : 0;
      again[i] = !chosen || (worth > 0 && trials_.choices()[i].back().squaredError > worth);
      if (again[i]) unchanged_[i] = 0;
    }
    if (std::find(again.begin(), again.end(), '\1') == again.end()) return false;
    trials_.tryMore(again);
    return true;
  }

  // With the least error that any encoding reaches.
  [[noreturn]] void throwOutOfReach() const {
    double error = 0;
    float worst = 0;
    for (std::size_t i = 0; i < grid_.leaves.size(); ++i) {
      const std::span<const Fit> fits = trials_.fits(i);
      const auto least = [&](auto member) {
        return *std::min_element(fits.begin(), fits.end(),
                                 [&](const Fit& a, const Fit& b) { return a.*member < b.*member; });
      };
      error += least(&Fit::squaredError).squaredError;
      worst = std::max(worst, least(&Fit::maxError).maxError);
    }
    const double rmse = std::sqrt(error / static_cast<double>(trials_.activeVoxels()));
    const double range = static_cast<double>(grid_.max) - static_cast<double>(grid_.min);
    throw Error(Fault::input,
                fmt::format("{}: the error asked for is out of reach: 16 bits a voxel reach {:.1f} dB and "
                            "a largest error of {:g}; ask for less",
                            where_, 20 * std::log10(range / rmse), worst));
  }

  const ImportedGrid& grid_;
  const Goal& goal_;
  GridTrials& trials_;
  const std::string& where_;
  std::vector<char> unchanged_;
};

}  // namespace

ChosenGrid decide(const ImportedGrid& grid, const Goal& goal, GridTrials& trials, const FrameBefore& before,
                  std::span<const char> unchanged, const std::string& where) {
  Decision decision(grid, goal, trials, where);
  decision.offerStored(before, unchanged);
  return decision.choose();
}

std::vector<ChosenGrid> chooseEncodings(std::span<const ImportedGrid> grids, const Quality& quality,
                                        const std::function<std::string(std::size_t)>& where) {
  std::vector<ChosenGrid> result(grids.size());
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (!grids[g].present || grids[g].leaves.empty()) continue;
    const Goal goal = goalOf(grids[g], quality);
    GridTrials trials(grids[g], goal, quality.effort, {});
    result[g] = decide(grids[g], goal, trials, {}, {}, where(g));
  }
  return result;
}

}  // namespace billow::compiler
