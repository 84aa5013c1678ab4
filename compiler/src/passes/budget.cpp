#include "passes/budget.h"

#include <fmt/format.h>

#include <algorithm>

#include "passes/survey.h"

namespace billow::compiler {
namespace {

// Ends of the search as places on the ladder, of errors in squares of a grid's range: 2^-64 to 2^6. Line integrals have
// a larger range than voxels; beyond what a grid's own curve holds it stays level.
constexpr double kFinest = -64 * 4;
constexpr double kCoarsest = 6 * 4;

// Parts of the budget. What exceeds it is lost time, and an estimate that no pass has corrected is less exact.
constexpr double kFirstAim = 0.993;
constexpr double kAim = 0.997;
constexpr double kEnough = 0.985;  // no further pass for the rest
constexpr int kMostPasses = 8;     // beside the survey

// Where both budgets are given, mixes of the two kinds of bytes, from nearly the GPU's alone to the disk's alone. A
// byte is as dear as its budget is small.
constexpr std::size_t kMixes = 9;
constexpr double kLeastShare = 1.0 / 64;
constexpr int kMixings = 4;  // passes that may have a mix of their own; the others keep the last one's

std::vector<RateWeights> mixesOf(const Budget& budget) {
  if (!budget.disk) return {{1, 0}};
  if (!budget.gpu) return {{0, 1}};
  const double gpu = std::max(static_cast<double>(*budget.gpu), 1.0);
  const double disk = std::max(static_cast<double>(*budget.disk), 1.0);
  std::vector<RateWeights> mixes;
  for (std::size_t m = 0; m < kMixes; ++m) {
    const double share = std::max(static_cast<double>(m) / (kMixes - 1), kLeastShare);
    mixes.push_back({(1 - share) * std::min(gpu, disk) / gpu, share * std::min(gpu, disk) / disk});
  }
  return mixes;
}

class Search {
 public:
  Search(const std::string& output, const CompileOptions& options, const Budget& budget, const Plan& plan,
         const Warn& warn)
      : output_(output),
        options_(options),
        budget_(budget),
        plan_(plan),
        mixes_(mixesOf(budget)),
        survey_(options, plan, mixes_, warn) {}

  std::unique_ptr<WritePass> run() {
    for (int pass = 0; pass < kMostPasses; ++pass) {
      const bool mixing = !balanced_ && pass < kMixings;
      if (mixing) chooseMix();
      const double place = nextPlace();
      attempt(place);
      if (fitting_ == place && (usage_ >= kEnough || place == kFinest) && (balanced_ || !mixing)) break;
      aim_ = kAim;
      if (tooFine_ == kCoarsest) throwOutOfReach();
      if (fitting_ - tooFine_ < kClose) break;
    }
    if (!best_) attempt(kCoarsest);
    if (!best_) throwOutOfReach();
    return std::move(best_);
  }

 private:
  static constexpr double kBalanced = 0.97;
  static constexpr double kEnd = 0.1;          // mixes that near an end are as good as it
  static constexpr double kClose = 1.0 / 256;  // places that near one another give the same pack

  static double part(double bytes, const std::optional<std::uint64_t>& budget) {
    return budget ? bytes / static_cast<double>(*budget) : 0;
  }
  // The largest of bytes / budget.
  double usage(const PackBytes& bytes) const {
    return std::max(part(bytes.gpu, budget_.gpu), part(bytes.disk, budget_.disk));
  }

  PackBytes estimate(double place) const {
    const PackBytes bytes = survey_.at(ladderMultiplier(place), mix_);
    return {effects_.gpu + bytes.gpu * correction_.gpu, effects_.disk + bytes.disk * correction_.disk};
  }

  // Near the finest place whose estimate fits.
  double finestThatFits() const {
    if (usage(estimate(kFinest)) <= aim_) return kFinest;
    double low = kFinest;
    double high = kCoarsest;
    while (high - low > kClose) {
      const double middle = (low + high) / 2;
      (usage(estimate(middle)) <= aim_ ? high : low) = middle;
    }
    return high;
  }

  // The mix at which both budgets bind by the estimate, or an end where one of them does alone.
  double foretoldMix() {
    double low = 0;
    double high = static_cast<double>(mixes_.size() - 1);
    for (int round = 0; round < 10; ++round) {
      mix_ = (low + high) / 2;
      const PackBytes bytes = estimate(finestThatFits());
      (part(bytes.gpu, budget_.gpu) > part(bytes.disk, budget_.disk) ? high : low) = mix_;
    }
    return (low + high) / 2;
  }

  // The error is least where each byte is paid for as the two budgets bind: both to the full, or one of them alone.
  // Between two mixes that were measured, where their balances say; else where the estimate does.
  void chooseMix() {
    mix_ = diskBinds_ && gpuBinds_ ? diskBinds_->mix + (gpuBinds_->mix - diskBinds_->mix) * (1 - diskBinds_->balance) /
                                                           (gpuBinds_->balance - diskBinds_->balance)
                                   : foretoldMix();
    tooFine_ = kFinest - 1;  // what was known is of another mix
    fitting_ = kCoarsest + 1;
  }

  void noteBalance() {
    if (mixes_.size() == 1) return;
    const double gpu = part(measured_.gpu, budget_.gpu);
    const double balance = gpu / std::max(part(measured_.disk, budget_.disk), 1e-9);
    (balance > 1 ? gpuBinds_ : diskBinds_) = Mixed{mix_, balance};
    // At an end one of them binds alone, and no mix helps the other.
    const double last = static_cast<double>(mixes_.size() - 1);
    const bool alone = balance > 1 ? mix_ < kEnd : mix_ > last - kEnd;
    balanced_ = alone || (balance >= kBalanced && balance <= 1 / kBalanced);
  }

  RateWeights weights() const {
    const auto before = static_cast<std::size_t>(mix_);
    const double fraction = mix_ - static_cast<double>(before);
    const RateWeights& from = mixes_[before];
    const RateWeights& to = mixes_[std::min(before + 1, mixes_.size() - 1)];
    return {from.gpu + fraction * (to.gpu - from.gpu), from.disk + fraction * (to.disk - from.disk)};
  }

  // The finest place whose estimate fits, within what is known.
  double nextPlace() const {
    const double high = finestThatFits();
    if (high == kFinest && tooFine_ < kFinest) return kFinest;
    if (high > tooFine_ && high < fitting_) return high;
    // The estimate contradicts what was measured.
    return fitting_ > kCoarsest ? kCoarsest : (std::max(tooFine_, kFinest) + fitting_) / 2;
  }

  void attempt(double place) {
    auto pass = std::make_unique<WritePass>(output_, options_, plan_);
    const double multiplier = ladderMultiplier(place);
    const RateWeights mixed = weights();
    const auto goal = [&](const Job& job, std::size_t grid, const ImportedGrid&) {
      return goalAt({multiplier * survey_.unit(job.volume, grid), mixed}, options_.quality);
    };
    pass->run(goal, [](const std::string&) {});  // the survey has warned
    const CompileReport& report = pass->report();
    measured_ = {static_cast<double>(report.gpuBytes), static_cast<double>(report.fileBytes)};
    usage_ = usage(measured_);
    const PackBytes expected = survey_.at(multiplier, mix_);
    effects_ = {static_cast<double>(report.effectGpuBytes), static_cast<double>(report.effectBytes)};
    correction_ = {(measured_.gpu - effects_.gpu) / std::max(expected.gpu, 1.0),
                   (measured_.disk - effects_.disk) / std::max(expected.disk, 1.0)};
    noteBalance();
    if (usage_ > 1) {
      tooFine_ = std::max(tooFine_, place);
    } else {
      fitting_ = place;
      const double error = comparableError(report);
      if (best_ && error >= leastError_) return;  // of another mix
      leastError_ = error;
      best_ = std::move(pass);
    }
  }

  // Of voxels, by whatever metric the bricks were chosen.
  double comparableError(const CompileReport& report) const {
    double sum = 0;
    std::size_t g = 0;
    for (std::size_t v = 0; v < plan_.volumes.size(); ++v) {
      for (std::size_t i = 0; i < plan_.volumes[v].grids.size(); ++i, ++g) {
        for (const EncodingTally& tally : report.grids[g].encodings) sum += tally.squaredError / survey_.unit(v, i);
      }
    }
    return sum;
  }

  // After a pass at kCoarsest.
  [[noreturn]] void throwOutOfReach() const {
    const bool gpu = budget_.gpu && measured_.gpu > static_cast<double>(*budget_.gpu);
    throw Error(Fault::input,
                fmt::format("{}: {} {} is out of reach: {}, the pack needs {:.0f} bytes", output_,
                            gpu ? "--gpu-budget" : "--disk-budget", gpu ? *budget_.gpu : *budget_.disk,
                            options_.quality.maxError ? "with every voxel within --max-error" : "at its least",
                            gpu ? measured_.gpu : measured_.disk));
  }

  const std::string& output_;
  const CompileOptions& options_;
  const Budget budget_;
  const Plan& plan_;
  const std::vector<RateWeights> mixes_;
  const Survey survey_;
  double mix_ = 0;  // of mixes_, or between two
  struct Mixed {
    double mix, balance;  // parts used, of the GPU's budget in those of the disk's
  };
  std::optional<Mixed> diskBinds_, gpuBinds_;  // the last that were measured
  bool balanced_ = mixes_.size() == 1;
  double aim_ = kFirstAim;
  PackBytes correction_{1, 1};
  PackBytes effects_{0, 0};         // what they take whatever the volumes do, known after a pass
  double tooFine_ = kFinest - 1;    // the coarsest place that was too large
  double fitting_ = kCoarsest + 1;  // the finest place that fitted
  PackBytes measured_;              // by the last pass
  double usage_ = 0;
  std::unique_ptr<WritePass> best_;
  double leastError_ = 0;  // best_'s
};

}  // namespace

std::unique_ptr<WritePass> fitBudget(const std::string& output, const CompileOptions& options, const Plan& plan,
                                     const Warn& warn) {
  const Budget& budget = options.budget;
  if (!budget.gpu || !budget.disk) return Search(output, options, budget, plan, warn).run();
  // The best for the GPU alone is the best for both where it happens to fit the disk.
  auto pass = Search(output, options, {budget.gpu, std::nullopt}, plan, warn).run();
  if (pass->report().fileBytes <= *budget.disk) return pass;
  pass.reset();
  return Search(output, options, budget, plan, [](const std::string&) {}).run();
}

}  // namespace billow::compiler
