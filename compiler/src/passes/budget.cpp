#include "passes/budget.h"

#include <fmt/format.h>

#include <algorithm>

#include "passes/survey.h"

namespace billow::compiler {
namespace {

// Ends of the search as places on the ladder, of errors in squares of a grid's range: 2^-46 to 2^6.
constexpr double kFinest = -46 * 4;
constexpr double kCoarsest = 6 * 4;

constexpr double kAim = 0.992;    // of the budget: the estimate is not exact, and what exceeds the budget is lost time
constexpr double kEnough = 0.97;  // of the budget: no further pass for the rest
constexpr int kMostPasses = 8;    // beside the survey

RateWeights weightsOf(const Budget& budget) {
  if (!budget.disk) return {1, 0};
  if (!budget.gpu) return {0, 1};
  // Both: a byte is as dear as its budget is small.
  const auto gpu = static_cast<double>(*budget.gpu);
  const auto disk = static_cast<double>(*budget.disk);
  return {std::min(gpu, disk) / std::max(gpu, 1.0), std::min(gpu, disk) / std::max(disk, 1.0)};
}

class Search {
 public:
  Search(const std::string& output, const CompileOptions& options, const Plan& plan, const Warn& warn)
      : output_(output),
        options_(options),
        plan_(plan),
        weights_(weightsOf(options.budget)),
        survey_(options, plan, weights_, warn) {}

  std::unique_ptr<WritePass> run() {
    for (int pass = 0; pass < kMostPasses; ++pass) {
      const double place = nextPlace();
      attempt(place);
      if (fitting_ == place && (usage_ >= kEnough || place == kFinest)) break;
      if (tooFine_ == kCoarsest) throwOutOfReach();
      if (fitting_ - tooFine_ < kClose) break;
    }
    if (!best_) attempt(kCoarsest);
    if (!best_) throwOutOfReach();
    return std::move(best_);
  }

 private:
  static constexpr double kClose = 1.0 / 256;  // places that near one another give the same pack

  // The largest of bytes / budget.
  double usage(const PackBytes& bytes) const {
    double most = 0;
    if (options_.budget.gpu) most = std::max(most, bytes.gpu / static_cast<double>(*options_.budget.gpu));
    if (options_.budget.disk) most = std::max(most, bytes.disk / static_cast<double>(*options_.budget.disk));
    return most;
  }

  PackBytes estimate(double place) const {
    const PackBytes bytes = survey_.at(ladderMultiplier(place));
    return {bytes.gpu * correction_.gpu, bytes.disk * correction_.disk};
  }

  // The finest place whose estimate fits, within what is known.
  double nextPlace() const {
    if (usage(estimate(kFinest)) <= kAim && tooFine_ < kFinest) return kFinest;
    double low = kFinest;
    double high = kCoarsest;
    while (high - low > kClose) {
      const double middle = (low + high) / 2;
      (usage(estimate(middle)) <= kAim ? high : low) = middle;
    }
    if (high > tooFine_ && high < fitting_) return high;
    // The estimate contradicts what was measured.
    return fitting_ > kCoarsest ? kCoarsest : (std::max(tooFine_, kFinest) + fitting_) / 2;
  }

  void attempt(double place) {
    auto pass = std::make_unique<WritePass>(output_, options_, plan_);
    const double multiplier = ladderMultiplier(place);
    const auto goal = [&](const Job& job, std::size_t grid, const ImportedGrid&) {
      return goalAt({multiplier * survey_.unit(job.volume, grid), weights_}, options_.quality);
    };
    pass->run(goal, [](const std::string&) {});  // the survey has warned
    const CompileReport& report = pass->report();
    measured_ = {static_cast<double>(report.gpuBytes), static_cast<double>(report.fileBytes)};
    usage_ = usage(measured_);
    const PackBytes expected = survey_.at(multiplier);
    correction_ = {measured_.gpu / std::max(expected.gpu, 1.0), measured_.disk / std::max(expected.disk, 1.0)};
    if (usage_ > 1) {
      tooFine_ = std::max(tooFine_, place);
    } else {
      fitting_ = place;
      best_ = std::move(pass);
    }
  }

  // After a pass at kCoarsest.
  [[noreturn]] void throwOutOfReach() const {
    const bool gpu = options_.budget.gpu && measured_.gpu > static_cast<double>(*options_.budget.gpu);
    throw Error(Fault::input,
                fmt::format("{}: {} {} is out of reach: {}, the pack needs {:.0f} bytes", output_,
                            gpu ? "--gpu-budget" : "--disk-budget", gpu ? *options_.budget.gpu : *options_.budget.disk,
                            options_.quality.maxError ? "with every voxel within --max-error" : "at its least",
                            gpu ? measured_.gpu : measured_.disk));
  }

  const std::string& output_;
  const CompileOptions& options_;
  const Plan& plan_;
  const RateWeights weights_;
  const Survey survey_;
  PackBytes correction_{1, 1};
  double tooFine_ = kFinest - 1;    // the coarsest place that was too large
  double fitting_ = kCoarsest + 1;  // the finest place that fitted
  PackBytes measured_;              // by the last pass
  double usage_ = 0;
  std::unique_ptr<WritePass> best_;
};

}  // namespace

std::unique_ptr<WritePass> fitBudget(const std::string& output, const CompileOptions& options, const Plan& plan,
                                     const Warn& warn) {
  return Search(output, options, plan, warn).run();
}

}  // namespace billow::compiler
