#include "choose/trials.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <utility>

#include "billow/format/gpu_size.h"
#include "choose/disk_estimate.h"
#include "encode/encode_for_disk.h"

namespace billow::compiler {
namespace {

// Constant, uniform 1 to 8, some of local and coarse, BC7 and BC7 again: room for them is made at once.
constexpr std::size_t kUsualChoices = 14;

constexpr std::uint32_t kBc7Bytes = 128;

// Of the record that any new brick has.
constexpr auto kRecordBytes = static_cast<std::uint32_t>(format::kGpuRecordBytes);

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

BrickSource GridTrials::source(std::size_t i) const {
  return {&grid_.leaves[i].values, &grid_.leaves[i].active, counts_[i], grid_.background};
}

// What a stored mask adds to brick i.
std::uint32_t GridTrials::maskBytes(std::size_t i) const {
  return counts_[i] == format::kBrickVoxels ? 0 : static_cast<std::uint32_t>(sizeof(format::Mask3));
}

double GridTrials::distortionOf(std::size_t i, const Candidate& candidate) const {
  return goal_.metric == Metric::depth ? DepthGoal::distortion(source(i), candidate) : candidate.squaredError;
}

void GridTrials::add(std::size_t i, const Candidate& candidate) {
  add(i, candidate, distortionOf(i, candidate),
      goal_.countsDisk ? estimateDiskBytes(candidate, grid_.leaves[i].active, counts_[i] != format::kBrickVoxels) : 0);
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
  bricks_[i].lastIndex.push_back(0);
}

void GridTrials::offer(std::size_t i, const ChosenBrick& stored, const Fit& fit, const Choice& choice) {
  bricks_[i].stored = &stored;
  bricks_[i].storedAt = static_cast<std::uint32_t>(choices_[i].size());
  choices_[i].push_back(choice);
  bricks_[i].tried.push_back(fit);
  bricks_[i].lastIndex.push_back(0);
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
  if (trials.lastIndex[choice] != 0) {
    encodeUniformForDisk(source(i), {trials.lastIndex[choice], goal_.bitWorth(), goal_.hardLimit}, candidate);
  } else if (format::isLocal(encoding)) {
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

}  // namespace billow::compiler
