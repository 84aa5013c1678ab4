// What GridTrials passes over: encodings that cannot win at the exchange of error for bytes, as far as that is known.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "billow/format/gpu_size.h"
#include "choose/trials.h"

namespace billow::compiler {
namespace {

// Of the record that any new brick has.
constexpr auto kRecordBytes = static_cast<std::uint32_t>(format::kGpuRecordBytes);

// How far the multiplier that guesses give may be off.
constexpr double kGuessFactor = 6;

// Largest indices that are tried where nothing is known of the exchange: two an octave, those that fill their bits too.
constexpr std::uint32_t kSurveyedLasts[] = {1, 2, 3, 5, 7, 11, 15, 22, 31, 45, 63, 90, 127, 181, 255};
// Parts of the number of steps that suits the exchange.
constexpr double kTriedParts[] = {0.6, 0.8, 0.9, 1, 1.1, 1.25};

// Where the cheapest mix will do already, no byte more pays.
double multiplierOf(const Allocation& mix) {
  return mix.multiplier > 0 ? mix.multiplier : std::numeric_limits<double>::infinity();
}

}  // namespace

// The share of the grid's error budget that the tried bricks have by their voxels. Tiles are exact and carry none, so
// it is spread over leaf voxels alone: a few noisy leaves beside a vast constant tile must not be let go on the tile's
// account.
double GridTrials::triedBudget() const {
  std::uint64_t voxels = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) voxels += skip_[i] ? 0 : counts_[i];
  return goal_.errorBudget(voxels, activeVoxels());
}

// Outliers are allowed here: the margin is asked for before the encodings are tried that can avoid them.
std::optional<GridTrials::Margin> GridTrials::margin() const {
  if (goal_.exchange) return Margin{goal_.exchange->multiplier, goal_.limit};
  if (!goal_.hasBudget()) return std::nullopt;
  std::vector<std::vector<Choice>> tried;
  for (std::size_t i = 0; i < choices_.size(); ++i) {
    if (!skip_[i]) tried.push_back(choices_[i]);
  }
  const auto mix = allocate(tried, triedBudget(), std::numeric_limits<float>::infinity());
  if (!mix) return std::nullopt;
  return Margin{multiplierOf(*mix), goal_.limit};
}

// The same where bricks are constant or uniform and as good as guessed.
std::optional<GridTrials::Margin> GridTrials::guessedMargin() const {
  if (goal_.exchange || !goal_.hasBudget()) return margin();
  std::vector<std::vector<Choice>> guessed;
  for (std::size_t i = 0; i < choices_.size(); ++i) {
    if (skip_[i]) continue;
    guessed.push_back(choices_[i]);
    for (std::uint32_t bits = 1; bits <= 8 && !quiet_[i]; ++bits) {
      const std::uint32_t bytes = kRecordBytes + *format::brickBytes(format::uniformEncoding(bits));
      guessed.back().push_back({bytes, guesses_[i][bits - 1], 0});
    }
  }
  const auto mix = allocate(guessed, triedBudget(), std::numeric_limits<float>::infinity());
  if (!mix) return std::nullopt;
  return Margin{multiplierOf(*mix), goal_.limit};
}

// The numbers of bits of a uniform brick, first and last, that may win at the margin: all where that is not known.
std::pair<std::uint32_t, std::uint32_t> GridTrials::bitsWorthFitting(std::size_t i,
                                                                     const std::optional<Margin>& known) const {
  // With one bit that says which voxels are active nothing is left: that is a constant.
  const std::uint32_t least = counts_[i] == format::kBrickVoxels ? 1 : 2;
  if (!known) return {least, 8};
  const auto cheapestBits = [&](double multiplier) {
    std::uint32_t best = least;
    const auto cost = [&](std::uint32_t bits) {
      const std::uint32_t bytes = *format::brickBytes(format::uniformEncoding(bits));
      return guesses_[i][bits - 1] + multiplier * rate(bytes, bytes / 2);
    };
    for (std::uint32_t bits = least + 1; bits <= 8; ++bits) {
      if (cost(bits) < cost(best)) best = bits;
    }
    return best;
  };
  const std::uint32_t first = cheapestBits(known->multiplier * kGuessFactor);
  std::uint32_t last = cheapestBits(known->multiplier / kGuessFactor);
  // Half a step of evenly spread levels, three times its mean square, must keep the bound on single voxels.
  const double limit = static_cast<double>(known->limit);
  while (last < 8 && 3 * guesses_[i][last - 1] / counts_[i] > limit * limit) ++last;
  return {first, last};
}

// Where disk counts, a brick's steps are free: fewer than its bits allow weigh less.
std::vector<std::uint32_t> GridTrials::lastsWorthTrying(std::size_t i) const {
  const std::uint32_t first = counts_[i] == format::kBrickVoxels ? 0 : 1;
  std::vector<std::uint32_t> lasts(std::begin(kSurveyedLasts) + first, std::end(kSurveyedLasts));
  if (!goal_.exchange) return lasts;
  if (!(goal_.exchange->weights.gpu > 0)) lasts.clear();
  // At an exchange of d squared error for a bit, a uniform quantiser's best step is the root of 6 d / ln 2.
  const double step = std::sqrt(goal_.bitWorth() * 8.656170245333781);
  const double halves = first == 0 ? 2 : 1;  // back from the error of evenly spread values of one bit
  const double range = std::sqrt(guesses_[i][0] * 12 / counts_[i]) * halves;
  for (const double part : kTriedParts) {
    const double steps = std::clamp(range / step * part + 0.5, 1.0, 255.0);
    lasts.push_back(std::min(static_cast<std::uint32_t>(steps) + first, 255u));
  }
  std::sort(lasts.begin(), lasts.end());
  lasts.erase(std::unique(lasts.begin(), lasts.end()), lasts.end());
  return lasts;
}

double GridTrials::rate(std::uint32_t bytes, std::uint32_t diskBytes) const {
  if (!goal_.exchange) return bytes;
  return goal_.exchange->weights.gpu * bytes + goal_.exchange->weights.disk * diskBytes;
}

// Could an encoding of `bytes`, its mask included, with this error win on brick i? Always where the margin is not
// known.
bool GridTrials::mayPay(std::size_t i, std::uint32_t bytes, double squaredError,
                        const std::optional<Margin>& known) const {
  if (!known) return true;
  for (const double multiplier : {known->multiplier * 0.5, known->multiplier * 2}) {
    const double hoped = squaredError + multiplier * rate(kRecordBytes + bytes, bytes / 2);
    const auto wins = [&](const Choice& other) {
      return other.maxError > known->limit ||
             hoped < other.squaredError + multiplier * rate(other.bytes, other.diskBytes);
    };
    if (std::all_of(choices_[i].begin(), choices_[i].end(), wins)) return true;
  }
  return false;
}

}  // namespace billow::compiler
