#include "choose/choose.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <numeric>
#include <set>
#include <utility>

#include "billow/format/gpu_size.h"
#include "parallel.h"
#include "share/share.h"

namespace billow::compiler {
namespace {

// Mean error alone would let single voxels go far astray in bricks that are otherwise quiet. So with a PSNR, no voxel's
// error may exceed this many times the root mean square error that the PSNR allows (at 45 dB: 9 % of the range). Costs
// about 1 % of bytes on real smoke and fire.
constexpr double kOutlierLimit = 16;

// From this effort on every brick that BC7 might suit is encoded at full effort.
constexpr int kFullEffort = 3;

// Bytes that a stored mask adds beside a brick (spec: Mask3).
constexpr std::uint32_t kMaskBytes = sizeof(format::Mask3);

// Constant, R8, BC4, BC7 and BC7 again, and what their payloads take: room for them is made at once.
constexpr std::size_t kUsualChoices = 5;
constexpr std::size_t kUsualPayload = 512 + 256 + 128 + 128;

// A tried encoding whose payload lies in the brick's arena.
struct Tried {
  std::uint32_t encoding;
  bool texelMask;
  float lo, scale;
  std::uint32_t payloadBegin;
};

struct BrickTrials {
  std::vector<Tried> tried;  // beside the brick's choices
  std::vector<std::byte> arena;
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
  }

  // Squared error that `psnr` dB allow. Tiles are exact and carry none, so it is spread over leaf voxels alone: a few
  // noisy leaves beside a vast constant tile must not be let go on the tile's account.
  double budget(std::optional<double> psnr) const {
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

  void tryR8() {
    forEachBrick([this](std::size_t i, Candidate& candidate) {
      if (quiet_[i]) return;
      encodeR8(source(i), candidate);
      add(i, candidate);
    });
  }

  // BC4 and BC7 are dear to try, so they are left out where they cannot pay: the mix so far has a Lagrange multiplier
  // at the PSNR asked, and a brick is passed over where even an optimistic guess of the new encoding's error loses
  // against the brick's other choices at that multiplier, halved and doubled (the final one differs a little).
  void tryBc4(std::optional<double> psnr) {
    constexpr double kOptimism = 1;  // of R8's error, with half of its bits
    const auto multiplier = multiplierAt(psnr);
    forEachBrick([&](std::size_t i, Candidate& candidate) {
      if (quiet_[i] || !mayPay(i, 256, choices_[i][1].squaredError * kOptimism, multiplier)) return;
      encodeBc4BestAxis(source(i), candidate);
      add(i, candidate);
    });
  }

  void tryBc7(std::optional<double> psnr) {
    constexpr double kOptimism = 1.5;  // of BC4's error, with half of its bits
    const auto multiplier = multiplierAt(psnr);
    const int effort = refinesBc7(psnr) ? 0 : quality_.effort;
    forEachBrick([&](std::size_t i, Candidate& candidate) {
      if (quiet_[i] || choices_[i].size() < 3) return;
      if (!mayPay(i, 128, choices_[i][2].squaredError * kOptimism, multiplier)) return;
      encodeBc7BestAxis(source(i), effort, candidate);
      add(i, candidate);
    });
    if (refinesBc7(psnr)) refineBc7(psnr);
  }

  void tryR16() {
    if (std::exchange(r16Tried_, true)) return;
    forEachBrick([this](std::size_t i, Candidate& candidate) {
      encodeR16(source(i), candidate);
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
      tryR16();
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
      const Tried& tried = bricks_[i].tried[chosen[i]];
      format::countBrick(frame, tried.encoding);
      if (!tried.texelMask && counts_[i] != format::kBrickVoxels) ++frame.maskCount;
    }
    return format::gpuBytes(frame).total();
  }

  // The least error that any encoding reaches, for the message.
  std::string best() const {
    double error = 0;
    float worst = 0;
    std::uint64_t voxels = 0;
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
      error += choices_[i].back().squaredError;
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
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
      const Tried& tried = bricks_[i].tried[chosen[i]];
      const Choice& choice = choices_[i][chosen[i]];
      ChosenBrick& brick = result.bricks[i];
      brick = {tried.encoding, tried.texelMask, tried.lo, tried.scale, {}};
      const auto begin = bricks_[i].arena.begin() + tried.payloadBegin;
      brick.payload.assign(begin, begin + *format::brickBytes(tried.encoding));
      result.squaredError += choice.squaredError;
      result.maxError = std::max(result.maxError, choice.maxError);
    }
    return result;
  }

 private:
  double rmseAt(double psnr) const {
    return (static_cast<double>(grid_.max) - static_cast<double>(grid_.min)) / std::pow(10.0, psnr / 20.0);
  }
  // The largest error that a voxel may have.
  float errorLimit(std::optional<double> psnr) const {
    float limit = quality_.maxError.value_or(std::numeric_limits<float>::infinity());
    if (psnr) limit = std::min(limit, static_cast<float>(kOutlierLimit * rmseAt(*psnr)));
    return limit;
  }
  BrickSource source(std::size_t i) const {
    return {&grid_.leaves[i].values, &grid_.leaves[i].active, counts_[i], grid_.background};
  }
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
    const std::uint32_t mask = counts_[i] == format::kBrickVoxels ? 0 : kMaskBytes;
    for (const double multiplier : {margin->multiplier * 0.5, margin->multiplier * 2}) {
      const double hoped = squaredError + multiplier * (bytes + mask);
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
      if (candidate.squaredError < choices_[i][choice].squaredError) add(i, candidate);
    });
  }

  void add(std::size_t i, const Candidate& candidate) {
    const std::uint32_t bytes = *format::brickBytes(candidate.encoding);
    const bool stored = counts_[i] != format::kBrickVoxels && !candidate.texelMask;
    if (choices_[i].empty()) choices_[i].reserve(kUsualChoices);
    choices_[i].push_back({bytes + (stored ? kMaskBytes : 0), candidate.squaredError, candidate.maxError});
    BrickTrials& brick = bricks_[i];
    if (brick.tried.empty()) brick.tried.reserve(kUsualChoices);
    if (brick.arena.empty() && bytes != 0) brick.arena.reserve(kUsualPayload);
    brick.tried.push_back({candidate.encoding, candidate.texelMask, candidate.lo, candidate.scale,
                           static_cast<std::uint32_t>(brick.arena.size())});
    brick.arena.insert(brick.arena.end(), candidate.payload.begin(), candidate.payload.begin() + bytes);
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
  bool r16Tried_ = false;
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
    choosers[g]->tryR8();
    choosers[g]->tryBc4(quality.psnr);
    choosers[g]->tryBc7(quality.psnr);
    if (quality.maxError) choosers[g]->tryR16();
  }
  std::vector<std::vector<std::uint32_t>> chosen(grids.size());
  if (quality.gpuBudget) chosen = fitBudget(choosers, quality, tileBytes, where);
  std::vector<ChosenGrid> result(grids.size());
  for (std::size_t g = 0; g < grids.size(); ++g) {
    if (!choosers[g]) continue;
    if (!quality.gpuBudget) chosen[g] = choosers[g]->solveOrThrow(quality.psnr, where(g));
    result[g] = choosers[g]->take(chosen[g]);
    choosers[g].reset();
  }
  return result;
}

}  // namespace billow::compiler
