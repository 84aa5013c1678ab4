#include "choose/choose.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <numeric>
#include <set>
#include <utility>

#include "billow/format/gpu_size.h"
#include "choose/depth_goal.h"
#include "parallel.h"
#include "share/share.h"

namespace billow::compiler {
namespace {

// Mean error alone would let single voxels go far astray in bricks that are otherwise quiet. So with a PSNR, no voxel's
// error may exceed this many times the root mean square error that the PSNR allows (at 47 dB: 2.2 % of the range).
// Pictures of thin haze, where rays meet few voxels, gain most by it (spec/rationale.md).
constexpr double kOutlierLimit = 5;

// From this effort on every brick that BC7 might suit is encoded at full effort.
constexpr int kFullEffort = 3;

// Bytes that a stored mask adds beside a brick (spec: Mask3).
constexpr std::uint32_t kMaskBytes = sizeof(format::Mask3);

// Constant, uniform 1 to 8, some of local and coarse, BC7 and BC7 again: room for them is made at once.
constexpr std::size_t kUsualChoices = 14;

constexpr std::uint32_t kBc7Bytes = 128;

struct BrickTrials {
  std::vector<Fit> tried;      // beside the brick's choices
  std::vector<std::byte> bc7;  // payloads of those that are BC7, in their order; others are encoded again when taken
};

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

class GridChooser {
 public:
  GridChooser(const ImportedGrid& grid, const Quality& quality) : grid_(grid), quality_(quality) {
    bricks_.resize(grid.leaves.size());
    choices_.resize(grid.leaves.size());
    if (quality.metric == Metric::depth) depth_.emplace(grid, *quality.psnr);
  }

  // Squared error that `psnr` dB allow. Tiles are exact and carry none, so it is spread over leaf voxels alone: a few
  // noisy leaves beside a vast constant tile must not be let go on the tile's account.
  double budget(std::optional<double> psnr) const {
    if (depth_) return depth_->budget();
    if (!psnr) return std::numeric_limits<double>::infinity();
    std::uint64_t voxels = 0;
    for (const std::uint32_t count : counts_) voxels += count;
    const double rmse = rmseAt(*psnr);
    return rmse * rmse * static_cast<double>(voxels) * (1 - 1e-6);
  }

  void tryConstants() {
    counts_.resize(bricks_.size());
    forEachBrick([this](std::size_t i, Candidate& candidate) {
      const format::Mask3& active = grid_.leaves[i].active;
      std::uint32_t count = 0;
      for (const std::uint32_t word : active.words) count += static_cast<std::uint32_t>(std::popcount(word));
      counts_[i] = count;
      encodeConstant(source(i), candidate);
      add(i, candidate);
    });
  }

  // Bricks that stay constant whatever else happens: together they use at most a quarter of the budget.
  void settleQuietBricks(std::optional<double> psnr) {
    quiet_.assign(bricks_.size(), 0);
    if (!psnr) return;
    const float limit = errorLimit(psnr);
    std::vector<std::uint32_t> order(bricks_.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto error = [this](std::uint32_t i) { return choices_[i][0].squaredError; };
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return error(a) < error(b); });
    const double share = budget(psnr) * 0.25;
    double spent = 0;
    for (const std::uint32_t i : order) {
      spent += error(i);
      if (spent > share) break;
      quiet_[i] = choices_[i][0].maxError <= limit;
    }
  }

  void tryUniform() {
    forEachBrick([this](std::size_t i, Candidate& candidate) {
      if (quiet_[i]) return;
      std::array<Fit, 8> fits;
      fitUniforms(source(i), fits);
      // With one bit that says which voxels are active nothing is left: that is a constant.
      const std::size_t first = fits[0].texelMask ? 1 : 0;
      for (std::size_t f = first; f < fits.size(); ++f) {
        if (!depth_) {
          add(i, fits[f], fits[f].squaredError);
          continue;
        }
        encodeUniform(source(i), static_cast<std::uint32_t>(f + 1), candidate);
        add(i, candidate);
      }
    });
  }

  // The others are dear to try, so they are left out where they cannot pay: the mix so far has a Lagrange multiplier
  // at the PSNR asked, and a brick is passed over where even an optimistic guess of the new encoding's error loses
  // against the brick's other choices at that multiplier, halved and doubled (the final one differs a little).
  void tryLocal(std::optional<double> psnr) {
    constexpr double kOptimism = 0.5;  // of the error of values that fill their cells' ranges evenly
    const auto multiplier = multiplierAt(psnr);
    forEachBrick([&](std::size_t i, Candidate& candidate) {
      if (quiet_[i]) return;
      const std::array<double, 5> guesses = estimateLocals(source(i));
      for (std::uint32_t bits = 2; bits <= 6; ++bits) {
        const std::uint32_t bytes = *format::brickBytes(format::localEncoding(bits));
        if (!mayPay(i, bytes, guesses[bits - 2] * noiseDistortion() * kOptimism, multiplier)) continue;
        encodeLocal(source(i), bits, candidate);
        add(i, candidate);
      }
    });
  }

  void tryCoarse(std::optional<double> psnr) {
    const auto multiplier = multiplierAt(psnr);
    forEachBrick([&](std::size_t i, Candidate& candidate) {
      if (quiet_[i] || !mayPay(i, 64 + maskBytes(i), 0, multiplier)) return;
      encodeCoarse(source(i), candidate);
      add(i, candidate);
    });
  }

  void tryBc7(std::optional<double> psnr) {
    constexpr double kOptimism = 0.1;  // of the error of uniform bricks with as many bits
    const auto multiplier = multiplierAt(psnr);
    const int effort = refinesBc7(psnr) ? 0 : quality_.effort;
    forEachBrick([&](std::size_t i, Candidate& candidate) {
      if (quiet_[i]) return;
      const auto& tried = bricks_[i].tried;
      const auto two = std::find_if(tried.begin(), tried.end(),
                                    [](const Fit& fit) { return fit.encoding == format::uniformEncoding(2); });
      const Choice& twoBits = choices_[i][static_cast<std::size_t>(two - tried.begin())];
      if (!mayPay(i, kBc7Bytes + maskBytes(i), twoBits.squaredError * kOptimism, multiplier)) return;
      encodeBc7BestAxis(source(i), effort, candidate);
      add(i, candidate);
    });
    if (refinesBc7(psnr)) refineBc7(psnr);
  }

  void tryUniform16() {
    if (std::exchange(uniform16Tried_, true)) return;
    forEachBrick([this](std::size_t i, Candidate& candidate) {
      encodeUniform(source(i), 16, candidate);
      add(i, candidate);
    });
  }

  std::optional<Allocation> solve(std::optional<double> psnr) const {
    return allocate(choices_, budget(psnr), errorLimit(psnr));
  }

  // The cheapest choices at `psnr` dB, with 16-bit bricks tried where nothing less will do.
  std::vector<std::uint32_t> solveOrThrow(std::optional<double> psnr, const std::string& where) {
    auto chosen = solve(psnr);
    if (!chosen) {
      tryUniform16();
      chosen = solve(psnr);
    }
    if (!chosen) {
      throw Error(Fault::input,
                  fmt::format("{}: the error asked for is out of reach: {}; ask for less", where, best()));
    }
    return std::move(chosen->chosen);
  }

  // GPU bytes of the grid with these choices, before equal nodes are shared.
  std::uint64_t gpuBytes(const std::vector<std::uint32_t>& chosen, const std::string& where) const {
    format::GridFrame frame = shape(grid_, where);
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
      const Fit& fit = bricks_[i].tried[chosen[i]];
      format::countBrick(frame, fit.encoding);
      if (!fit.texelMask && counts_[i] != format::kBrickVoxels) ++frame.maskCount;
    }
    return format::gpuBytes(frame).total();
  }

  // The least error that any encoding reaches, for the message.
  std::string best() const {
    double error = 0;
    float worst = 0;
    std::uint64_t voxels = 0;
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
      error += bricks_[i].tried.back().squaredError;
      worst = std::max(worst, choices_[i].back().maxError);
      voxels += counts_[i];
    }
    const double rmse = std::sqrt(error / static_cast<double>(voxels));
    const double range = static_cast<double>(grid_.max) - static_cast<double>(grid_.min);
    return fmt::format("16 bits a voxel reach {:.1f} dB and a largest error of {:g}", 20 * std::log10(range / rmse),
                       worst);
  }

  ChosenGrid take(const std::vector<std::uint32_t>& chosen) {
    ChosenGrid result;
    result.bricks.resize(bricks_.size());
    forEachBrick([&](std::size_t i, Candidate& candidate) { takeBrick(i, chosen[i], candidate, result.bricks[i]); });
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
      const Fit& fit = bricks_[i].tried[chosen[i]];
      result.squaredError += fit.squaredError;
      result.maxError = std::max(result.maxError, fit.maxError);
    }
    return result;
  }

  // The cheapest bricks that keep to what was asked.
  ChosenGrid settle(const std::string& where) {
    ChosenGrid result = take(solveOrThrow(quality_.psnr, where));
    while (depth_ && !depth_->holds(result.bricks)) result = take(solveOrThrow(quality_.psnr, where));
    return result;
  }

 private:
  // Distortion a squared error, of errors without pattern.
  double noiseDistortion() const { return depth_ ? DepthGoal::kDistortionOfNoise : 1; }
  double rmseAt(double psnr) const {
    return (static_cast<double>(grid_.max) - static_cast<double>(grid_.min)) / std::pow(10.0, psnr / 20.0);
  }
  // The largest error that a voxel may have.
  float errorLimit(std::optional<double> psnr) const {
    float limit = quality_.maxError.value_or(std::numeric_limits<float>::infinity());
    if (depth_) return std::min(limit, depth_->limit());
    if (psnr) limit = std::min(limit, static_cast<float>(kOutlierLimit * rmseAt(*psnr)));
    return limit;
  }
  BrickSource source(std::size_t i) const {
    return {&grid_.leaves[i].values, &grid_.leaves[i].active, counts_[i], grid_.background};
  }
  void takeBrick(std::size_t i, std::uint32_t choice, Candidate& candidate, ChosenBrick& brick) const {
    const BrickTrials& trials = bricks_[i];
    const Fit& fit = trials.tried[choice];
    const std::uint32_t bits = format::indexBits(fit.encoding);
    const std::byte* payload = candidate.payload.data();
    if (format::isBc7(fit.encoding)) {
      const auto before = std::count_if(trials.tried.begin(), trials.tried.begin() + choice,
                                        [](const Fit& other) { return format::isBc7(other.encoding); });
      payload = trials.bc7.data() + before * kBc7Bytes;
    } else if (format::isLocal(fit.encoding)) {
      encodeLocal(source(i), bits, candidate);
    } else if (fit.encoding == format::kEncodingCoarse) {
      encodeCoarse(source(i), candidate);
    } else if (bits != 0) {
      encodeUniform(source(i), bits, candidate);
    }
    brick = {fit.encoding, fit.texelMask, fit.lo, fit.scale, fit.squaredError, {}};
    brick.payload.assign(payload, payload + *format::brickBytes(fit.encoding));
  }
  // What a stored mask adds to brick i.
  std::uint32_t maskBytes(std::size_t i) const { return counts_[i] == format::kBrickVoxels ? 0 : kMaskBytes; }
  // Squared error that a byte saves at the margin in the mix so far, outliers allowed; and the largest error that
  // counts.
  struct Margin {
    double multiplier;
    float limit;
  };
  std::optional<Margin> multiplierAt(std::optional<double> psnr) const {
    if (!psnr) return std::nullopt;
    const auto mix = allocate(choices_, budget(psnr), std::numeric_limits<float>::infinity());
    if (!mix) return std::nullopt;
    return Margin{mix->multiplier, errorLimit(psnr)};
  }
  // Could an encoding of `bytes` with this error win on brick i? Always where the margin is not known.
  bool mayPay(std::size_t i, std::uint32_t bytes, double squaredError, const std::optional<Margin>& margin) const {
    if (!margin) return true;
    for (const double multiplier : {margin->multiplier * 0.5, margin->multiplier * 2}) {
      const double hoped = squaredError + multiplier * bytes;
      const auto wins = [&](const Choice& other) {
        return other.maxError > margin->limit || hoped < other.squaredError + multiplier * other.bytes;
      };
      if (std::all_of(choices_[i].begin(), choices_[i].end(), wins)) return true;
    }
    return false;
  }

  // Up to effort 2 every brick is judged by BC7's fastest encoder, and only those that end as BC7 are encoded better.
  bool refinesBc7(std::optional<double> psnr) const {
    return psnr && quality_.effort > 0 && quality_.effort < kFullEffort;
  }
  void refineBc7(std::optional<double> psnr) {
    const auto chosen = solve(psnr);
    if (!chosen) return;
    forEachBrick([&](std::size_t i, Candidate& candidate) {
      const std::uint32_t choice = chosen->chosen[i];
      const std::uint32_t encoding = bricks_[i].tried[choice].encoding;
      if (encoding < format::kEncodingBc7Z || encoding > format::kEncodingBc7X) return;
      encodeBc7(source(i), encoding, quality_.effort, candidate);
      if (candidate.squaredError < bricks_[i].tried[choice].squaredError) add(i, candidate);
    });
  }

  void add(std::size_t i, const Candidate& candidate) {
    add(i, candidate, depth_ ? DepthGoal::distortion(source(i), candidate) : candidate.squaredError);
    if (!format::isBc7(candidate.encoding)) return;
    bricks_[i].bc7.insert(bricks_[i].bc7.end(), candidate.payload.begin(), candidate.payload.begin() + kBc7Bytes);
  }
  // `distortion`: what the allocator trades for bytes.
  void add(std::size_t i, const Fit& fit, double distortion) {
    if (choices_[i].size() == 1) {
      choices_[i].reserve(kUsualChoices);
      bricks_[i].tried.reserve(kUsualChoices);
    }
    const std::uint32_t bytes = *format::brickBytes(fit.encoding) + (fit.texelMask ? 0 : maskBytes(i));
    choices_[i].push_back({bytes, distortion, fit.maxError});
    bricks_[i].tried.push_back(fit);
  }
  template <class Function>
  void forEachBrick(const Function& function) {
    parallelRanges(bricks_.size(), 16, [&](std::size_t begin, std::size_t end) {
      const auto candidate = std::make_unique<Candidate>();
      for (std::size_t i = begin; i != end; ++i) function(i, *candidate);
    });
  }

  const ImportedGrid& grid_;
  const Quality& quality_;
  std::vector<BrickTrials> bricks_;
  std::vector<std::vector<Choice>> choices_;
  std::vector<std::uint32_t> counts_;
  std::vector<char> quiet_;
  bool uniform16Tried_ = false;
  std::optional<DepthGoal> depth_;
};

// The best PSNR, the same for every grid, at which the frame fits the budget; bisected on 1/64 dB. Sharing one PSNR is
// one Lagrange multiplier over errors relative to each grid's range. `tileBytes`: what grids without bricks need.
std::vector<std::vector<std::uint32_t>> fitBudget(std::vector<std::unique_ptr<GridChooser>>& choosers,
                                                  const Quality& quality, std::uint64_t tileBytes,
                                                  const std::function<std::string(std::size_t)>& where) {
  constexpr int kSteps = 64 * 64;  // up to 64 dB, above what 8 bits a voxel reach
  std::vector<std::vector<std::uint32_t>> best;
  std::uint64_t least = 0;
  const auto fits = [&](int step) {
    std::vector<std::vector<std::uint32_t>> chosen(choosers.size());
    std::uint64_t bytes = tileBytes;
    for (std::size_t g = 0; g < choosers.size(); ++g) {
      if (!choosers[g]) continue;
      auto solved = choosers[g]->solve(step / 64.0);
      if (!solved) return false;
      chosen[g] = std::move(solved->chosen);
      bytes += choosers[g]->gpuBytes(chosen[g], where(g));
    }
    if (step == 0) least = bytes;
    if (bytes > *quality.gpuBudget) return false;
    best = std::move(chosen);
    return true;
  };
  // Whatever the budget, the largest error must be reachable: that is said first, and of the right grid.
  for (std::size_t g = 0; g < choosers.size(); ++g) {
    if (choosers[g]) choosers[g]->solveOrThrow(0.0, where(g));
  }
  if (!fits(0)) {
    throw Error(Fault::input, fmt::format("{}: --gpu-budget {} is out of reach: the frame needs {} bytes at the least",
                                          where(0), *quality.gpuBudget, least));
  }
  int low = 0;
  int high = kSteps;
  while (low + 1 < high) {
    const int middle = (low + high) / 2;
    (fits(middle) ? low : high) = middle;
  }
  return best;
}

}  // namespace

std::vector<ChosenGrid> chooseEncodings(std::span<const ImportedGrid> grids, const Quality& quality,
                                        const std::function<std::string(std::size_t)>& where) {
  std::vector<std::unique_ptr<GridChooser>> choosers(grids.size());
  std::uint64_t tileBytes = 0;
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (!grids[g].present) continue;
    if (grids[g].leaves.empty() && !grids[g].tiles.empty())
      tileBytes += format::gpuBytes(shape(grids[g], where(g))).total();
    if (grids[g].leaves.empty()) continue;
    choosers[g] = std::make_unique<GridChooser>(grids[g], quality);
    choosers[g]->tryConstants();
    choosers[g]->settleQuietBricks(quality.psnr);
    choosers[g]->tryUniform();
    choosers[g]->tryLocal(quality.psnr);
    choosers[g]->tryCoarse(quality.psnr);
    choosers[g]->tryBc7(quality.psnr);
    if (quality.maxError) choosers[g]->tryUniform16();
  }
  std::vector<std::vector<std::uint32_t>> chosen(grids.size());
  if (quality.gpuBudget) chosen = fitBudget(choosers, quality, tileBytes, where);
  std::vector<ChosenGrid> result(grids.size());
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (!choosers[g]) continue;
    result[g] = quality.gpuBudget ? choosers[g]->take(chosen[g]) : choosers[g]->settle(where(g));
    choosers[g].reset();
  }
  return result;
}

}  // namespace billow::compiler
