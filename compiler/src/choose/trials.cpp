#include "choose/trials.h"

#include <algorithm>
#include <array>
#include <bit>
#include <memory>
#include <numeric>
#include <utility>

#include "billow/format/gpu_size.h"
#include "choose/disk_estimate.h"
#include "parallel.h"

namespace billow::compiler {
namespace {

// From this effort on every brick that BC7 might suit is encoded at full effort.
constexpr int kFullEffort = 3;

// Of the record that any new brick has.
constexpr auto kRecordBytes = static_cast<std::uint32_t>(format::kGpuRecordBytes);

// Constant, uniform 1 to 8, some of local and coarse, BC7 and BC7 again: room for them is made at once.
constexpr std::size_t kUsualChoices = 14;

// How far the multiplier that guesses give may be off.
constexpr double kGuessFactor = 6;

constexpr std::uint32_t kBc7Bytes = 128;
constexpr std::uint32_t kCoarseBytes = 64;
constexpr std::uint32_t kWideBytes = 1024;

}  // namespace

GridTrials::GridTrials(const ImportedGrid& grid, const Goal& goal, int effort, std::span<const char> skip)
    : grid_(grid), goal_(goal), effort_(effort), skip_(skip.begin(), skip.end()) {
  bricks_.resize(grid.leaves.size());
  choices_.resize(grid.leaves.size());
  skip_.resize(grid.leaves.size());
  countVoxels();
  tryAll();
}

void GridTrials::tryAll() {
  tryConstants();
  settleQuietBricks();
  tryUniform();
  tryLocal();
  tryCoarse();
  tryBc7();
  if (!goal_.hasBudget()) tryWide();
}

std::uint64_t GridTrials::activeVoxels() const {
  return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0});
}

void GridTrials::countVoxels() {
  for (const Leaf& leaf : grid_.leaves) {
    std::uint32_t count = 0;
    for (const std::uint32_t word : leaf.active.words) count += static_cast<std::uint32_t>(std::popcount(word));
    counts_.push_back(count);
  }
}

void GridTrials::tryConstants() {
  forEachTried([this](std::size_t i, Candidate& candidate) {
    encodeConstant(source(i), candidate);
    add(i, candidate);
  });
}

// Bricks that stay constant whatever else happens: together they use at most a quarter of the budget.
void GridTrials::settleQuietBricks() {
  quiet_.assign(bricks_.size(), 0);
  if (!goal_.hasBudget()) return;
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < bricks_.size(); ++i) {
    if (!skip_[i]) order.push_back(i);
  }
  const auto error = [this](std::uint32_t i) { return choices_[i][0].squaredError; };
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return error(a) < error(b); });
  const double share = triedBudget() * 0.25;
  double spent = 0;
  for (const std::uint32_t i : order) {
    spent += error(i);
    if (spent > share) break;
    quiet_[i] = choices_[i][0].maxError <= goal_.limit;
  }
}

void GridTrials::tryUniform() {
  guesses_.resize(bricks_.size());
  forEachTried([this](std::size_t i, Candidate&) { guesses_[i] = estimateUniforms(source(i)); });
  const auto known = goal_.depth ? std::nullopt : guessedMargin();
  forEachTried([&](std::size_t i, Candidate& candidate) {
    if (quiet_[i]) return;
    const auto [first, last] = bitsWorthFitting(i, known);
    std::array<Fit, 8> fits;
    fitUniforms(source(i), first, last, fits);
    for (std::uint32_t bits = first; bits <= last; ++bits) {
      if (goal_.countsDisk || goal_.depth) {
        encodeUniform(source(i), bits, candidate);
        add(i, candidate);
      } else {
        add(i, fits[bits - 1], fits[bits - 1].squaredError, 0);
      }
    }
  });
}

// The encodings that follow are dear to try, so they are left out where they cannot pay: the mix so far has a Lagrange
// multiplier at the error asked, and a brick is passed over where even an optimistic guess of the new encoding's error
// loses against the brick's other choices at that multiplier, halved and doubled (the final one differs a little).
void GridTrials::tryLocal() {
  // Local bricks save about 2 % on the GPU and cost 8 % on disk, where uniform ones are coded better.
  if (!goal_.gpuAlone) return;
  constexpr double kOptimism = 0.5;  // of the error of values that fill their cells' ranges evenly
  const double optimism = kOptimism * (goal_.depth ? DepthGoal::kDistortionOfNoise : 1);
  const auto known = margin();
  forEachTried([&](std::size_t i, Candidate& candidate) {
    if (quiet_[i] || !mayPay(i, *format::brickBytes(format::kEncodingLocal2), 0, known)) return;
    const std::array<double, 5> guesses = estimateLocals(source(i));
    for (std::uint32_t bits = 2; bits <= 6; ++bits) {
      const std::uint32_t bytes = *format::brickBytes(format::localEncoding(bits));
      if (!mayPay(i, bytes, guesses[bits - 2] * optimism, known)) continue;
      encodeLocal(source(i), bits, candidate);
      add(i, candidate);
    }
  });
}

void GridTrials::tryCoarse() {
  constexpr double kOptimism = 0.15;  // of the error if all that bends were noise
  const auto known = margin();
  forEachTried([&](std::size_t i, Candidate& candidate) {
    if (quiet_[i]) return;
    const double hoped = goal_.depth ? 0 : estimateCoarse(source(i)) * kOptimism;
    if (!mayPay(i, kCoarseBytes + maskBytes(i), hoped, known)) return;
    encodeCoarse(source(i), candidate);
    add(i, candidate);
  });
}

void GridTrials::tryBc7() {
  constexpr double kOptimism = 0.1;  // of the error of uniform bricks with as many bits
  const double optimism = kOptimism * (goal_.depth ? DepthGoal::kDistortionOfNoise : 1);
  const auto known = margin();
  const int effort = refinesBc7() ? 0 : effort_;
  forEachTried([&](std::size_t i, Candidate& candidate) {
    if (quiet_[i] || !mayPay(i, kBc7Bytes + maskBytes(i), guesses_[i][1] * optimism, known)) return;
    encodeBc7BestAxis(source(i), effort, candidate);
    add(i, candidate);
  });
  if (refinesBc7()) refineBc7();
}

void GridTrials::tryWide() {
  if (std::exchange(triedWide_, true)) return;
  const auto known = goal_.exchange ? margin() : std::nullopt;
  forEachTried([&](std::size_t i, Candidate& candidate) {
    if (!mayPay(i, kWideBytes, 0, known)) return;
    encodeUniform(source(i), 16, candidate);
    add(i, candidate);
  });
}

// Up to effort 2 every brick is judged by BC7's fastest encoder, and only those that end as BC7 are encoded better.
bool GridTrials::refinesBc7() const {
  return goal_.hasBudget() && effort_ > 0 && effort_ < kFullEffort;
}

void GridTrials::refineBc7() {
  std::vector<std::vector<Choice>> tried;
  std::vector<std::uint32_t> place(bricks_.size());
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    place[i] = static_cast<std::uint32_t>(tried.size());
    if (!skip_[i]) tried.push_back(choices_[i]);
  }
  const auto chosen = allocate(tried, triedBudget(), goal_.limit);
  if (!chosen) return;
  forEachTried([&](std::size_t i, Candidate& candidate) {
    const std::uint32_t choice = chosen->chosen[place[i]];
    const std::uint32_t encoding = bricks_[i].tried[choice].encoding;
    if (!format::isBc7(encoding)) return;
    encodeBc7(source(i), encoding, effort_, candidate);
    if (candidate.squaredError < bricks_[i].tried[choice].squaredError) add(i, candidate);
  });
}

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
  return Margin{mix->multiplier, goal_.limit};
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
  return Margin{mix->multiplier, goal_.limit};
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

BrickSource GridTrials::source(std::size_t i) const {
  return {&grid_.leaves[i].values, &grid_.leaves[i].active, counts_[i], grid_.background};
}

// What a stored mask adds to brick i.
std::uint32_t GridTrials::maskBytes(std::size_t i) const {
  return counts_[i] == format::kBrickVoxels ? 0 : static_cast<std::uint32_t>(sizeof(format::Mask3));
}

void GridTrials::add(std::size_t i, const Candidate& candidate) {
  const bool mask = maskBytes(i) != 0 && !candidate.texelMask;
  add(i, candidate, goal_.depth ? DepthGoal::distortion(source(i), candidate) : candidate.squaredError,
      goal_.countsDisk ? estimateDiskBytes(candidate, grid_.leaves[i].active, mask) : 0);
  if (!format::isBc7(candidate.encoding)) return;
  bricks_[i].bc7.insert(bricks_[i].bc7.end(), candidate.payload.begin(), candidate.payload.begin() + kBc7Bytes);
}

// `distortion`: what the decision trades for bytes.
void GridTrials::add(std::size_t i, const Fit& fit, double distortion, std::uint32_t diskBytes) {
  if (choices_[i].size() == 1) {
    choices_[i].reserve(kUsualChoices);
    bricks_[i].tried.reserve(kUsualChoices);
  }
  const std::uint32_t bytes = kRecordBytes + *format::brickBytes(fit.encoding) + (fit.texelMask ? 0 : maskBytes(i));
  choices_[i].push_back({bytes, distortion, fit.maxError, diskBytes});
  bricks_[i].tried.push_back(fit);
}

void GridTrials::offer(std::size_t i, const ChosenBrick& stored, const Fit& fit, const Choice& choice) {
  bricks_[i].stored = &stored;
  bricks_[i].storedAt = static_cast<std::uint32_t>(choices_[i].size());
  choices_[i].push_back(choice);
  bricks_[i].tried.push_back(fit);
}

void GridTrials::tryMore(std::span<const char> again) {
  std::vector<char> skip(again.size());
  std::transform(again.begin(), again.end(), skip.begin(), [](char wanted) { return !wanted; });
  GridTrials more(grid_, goal_, effort_, skip);
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    if (!again[i]) continue;
    skip_[i] = 0;
    more.offer(i, *bricks_[i].stored, bricks_[i].tried.back(), choices_[i].back());
    choices_[i] = std::move(more.choices_[i]);
    bricks_[i] = std::move(more.bricks_[i]);
  }
}

ChosenBrick GridTrials::take(std::size_t i, std::uint32_t choice) const {
  const Brick& trials = bricks_[i];
  const Fit& fit = trials.tried[choice];
  ChosenBrick brick;
  if (choice == trials.storedAt) {
    brick = *trials.stored;
    brick.reused = true;
  } else {
    brick = {fit.encoding, fit.texelMask, fit.lo, fit.scale, payloadOf(i, choice)};
  }
  brick.squaredError = fit.squaredError;
  brick.maxError = fit.maxError;
  return brick;
}

std::vector<std::byte> GridTrials::payloadOf(std::size_t i, std::uint32_t choice) const {
  const Brick& trials = bricks_[i];
  const std::uint32_t encoding = trials.tried[choice].encoding;
  if (format::isBc7(encoding)) {
    const auto before = std::count_if(trials.tried.begin(), trials.tried.begin() + choice,
                                      [](const Fit& other) { return format::isBc7(other.encoding); });
    const auto begin = trials.bc7.begin() + before * kBc7Bytes;
    return {begin, begin + kBc7Bytes};
  }
  Candidate candidate;
  const std::uint32_t bits = format::indexBits(encoding);
  if (format::isLocal(encoding)) {
    encodeLocal(source(i), bits, candidate);
  } else if (encoding == format::kEncodingCoarse) {
    encodeCoarse(source(i), candidate);
  } else if (bits != 0) {
    encodeUniform(source(i), bits, candidate);
  }
  return {candidate.payload.begin(), candidate.payload.begin() + *format::brickBytes(encoding)};
}

bool GridTrials::storesMask(std::size_t i, std::uint32_t choice) const {
  return maskBytes(i) != 0 && !bricks_[i].tried[choice].texelMask;
}

template <class Function>
void GridTrials::forEachTried(const Function& function) {
  parallelRanges(bricks_.size(), 16, [&](std::size_t begin, std::size_t end) {
    const auto candidate = std::make_unique<Candidate>();
    for (std::size_t i = begin; i != end; ++i) {
      if (!skip_[i]) function(i, *candidate);
    }
  });
}

}  // namespace billow::compiler
