// What GridTrials tries, and where.
#include <algorithm>
#include <array>
#include <utility>

#include "choose/disk_estimate.h"
#include "choose/trials.h"
#include "encode/encode_for_disk.h"

namespace billow::compiler {
namespace {

// From this effort on every brick that BC7 might suit is encoded at full effort.
constexpr int kFullEffort = 3;

constexpr std::uint32_t kBc7Bytes = 128;
constexpr std::uint32_t kCoarseBytes = 64;
constexpr std::uint32_t kWideBytes = 1024;

}  // namespace

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
  const bool depth = goal_.metric == Metric::depth;
  const auto known = depth ? std::nullopt : guessedMargin();
  forEachTried([&](std::size_t i, Candidate& candidate) {
    if (quiet_[i]) return;
    if (goal_.countsDisk) return tryForDisk(i, candidate);
    const auto [first, last] = bitsWorthFitting(i, known);
    std::array<Fit, 8> fits;
    fitUniforms(source(i), first, last, fits);
    for (std::uint32_t bits = first; bits <= last; ++bits) {
      if (depth) {
        encodeUniform(source(i), bits, candidate);
        add(i, candidate);
      } else {
        add(i, fits[bits - 1], fits[bits - 1].squaredError, 0);
      }
    }
  });
}

void GridTrials::tryForDisk(std::size_t i, Candidate& candidate) {
  for (const std::uint32_t last : lastsWorthTrying(i)) {
    const DiskUniform wanted{last, goal_.bitWorth(), goal_.hardLimit};
    const std::uint32_t length = encodeUniformForDisk(source(i), wanted, candidate);
    add(i, candidate, distortionOf(i, candidate), diskBytesOfIndices(length, maskBytes(i) != 0));
    bricks_[i].lastIndex.back() = last;
  }
}

// The encodings that follow are dear to try, so they are left out where they cannot pay: the mix so far has a Lagrange
// multiplier at the error asked, and a brick is passed over where even an optimistic guess of the new encoding's error
// loses against the brick's other choices at that multiplier, halved and doubled (the final one differs a little).
void GridTrials::tryLocal() {
  // Local bricks save about 2 % on the GPU and cost 8 % on disk, where uniform ones are coded better.
  if (!goal_.gpuAlone) return;
  constexpr double kOptimism = 0.5;  // of the error of values that fill their cells' ranges evenly
  const double optimism = kOptimism * goal_.distortionOfNoise();
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
    const double hoped = goal_.metric == Metric::depth ? 0 : estimateCoarse(source(i)) * kOptimism;
    if (!mayPay(i, kCoarseBytes + maskBytes(i), hoped, known)) return;
    encodeCoarse(source(i), candidate);
    add(i, candidate);
  });
}

void GridTrials::tryBc7() {
  constexpr double kOptimism = 0.1;  // of the error of uniform bricks with as many bits
  const double optimism = kOptimism * goal_.distortionOfNoise();
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

}  // namespace billow::compiler
