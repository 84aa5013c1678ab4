// BC7 bricks: eight blocks of 16 texels, four slices of the packed axis in a texel's channels.
#include "encode/bc7_block.h"
#include "encode/stored_order.h"
#include "encode/wide/wide_encoder.h"

namespace billow::compiler {
namespace {

constexpr std::uint32_t kBlocks = 8;
constexpr std::uint32_t kBlockBytes = 16;

struct BrickFit {
  Bc7Fit block[kBlocks];
  float error = 0;
};

void fitWithMode6(const StoredBrick& stored, const Bc7Search& search, BrickFit& fit) {
  fit.error = 0;
  for (std::uint32_t b = 0; b < kBlocks; ++b) {
    fit.block[b] = fitMode6(stored.plane(b), search);
    fit.error += fit.block[b].error;
  }
}

// Where one packed axis alone is pursued, mode 6 is fitted to all blocks at once.
bool isQuick(const Bc7Search& search) {
  return !search.everyAxis;
}

std::uint32_t axisOf(std::uint32_t i) {
  return format::packedAxis(format::kEncodingBc7Z + i);
}

// The sum of errors.
float quickFit(const BrickTargets& targets, std::uint32_t axis, const Bc7Search& search, WideMode6& fit) {
  WideBrick arranged;
  wideEncoder().arrange(targets, axis, arranged);
  return wideEncoder().fitMode6(arranged, search.passes, fit);
}

void take(const WideMode6& from, BrickFit& fit) {
  fit.error = 0;
  for (std::uint32_t b = 0; b < kBlocks; ++b) {
    Bc7Fit& block = fit.block[b];
    block = Bc7Fit{};
    for (std::uint32_t c = 0; c < 4; ++c) {
      block.line[0].first[c] = from.first[c][b];
      block.line[0].second[c] = from.second[c][b];
    }
    for (std::uint32_t i = 0; i < 16; ++i) block.steps.step[i >> 2][i & 3] = from.step[i][b];
    block.error = from.error[b];
    fit.error += block.error;
  }
}

// Of the three encodings the one that mode 6 serves best after one pass, and its fit after all.
std::uint32_t quickBestAxis(const BrickTargets& targets, const Bc7Search& search, BrickFit& fit) {
  WideBrick arranged[3];
  WideMode6 mode6;
  std::uint32_t best = 0;
  float least = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    wideEncoder().arrange(targets, axisOf(i), arranged[i]);
    const float error = wideEncoder().fitMode6(arranged[i], 1, mode6);
    if (i == 0 || error < least) {
      least = error;
      best = i;
    }
  }
  wideEncoder().fitMode6(arranged[best], search.passes, mode6);
  take(mode6, fit);
  return best;
}

void improve(const StoredBrick& stored, const Bc7Search& search, BrickFit& fit) {
  fit.error = 0;
  for (std::uint32_t b = 0; b < kBlocks; ++b) {
    tryOtherModes(stored.plane(b), search, fit.block[b]);
    fit.error += fit.block[b].error;
  }
}

std::uint32_t leastError(const BrickFit fits[3]) {
  std::uint32_t least = 0;
  for (std::uint32_t i = 1; i < 3; ++i) {
    if (fits[i].error < fits[least].error) least = i;
  }
  return least;
}

void store(const BrickSource& brick, std::uint32_t encoding, TexelRange range, const BrickFit& fit, Candidate& out) {
  out.encoding = encoding;
  out.texelMask = false;
  out.lo = range.lo;
  out.scale = range.scale;
  for (std::uint32_t b = 0; b < kBlocks; ++b) packBlock(fit.block[b], &out.payload[b * kBlockBytes]);
  format::Texels texels;
  format::decodeTexels(encoding, {out.payload.data(), kBlocks * kBlockBytes}, texels);
  wideEncoder().measure(brick, texels, out);
}

}  // namespace

void encodeBc7(const BrickSource& brick, std::uint32_t encoding, int effort, Candidate& out) {
  const BrickTargets targets(brick);
  const Bc7Search search = bc7Search(effort);
  const std::uint32_t axis = format::packedAxis(encoding);
  BrickFit fit;
  if (isQuick(search)) {
    WideMode6 mode6;
    quickFit(targets, axis, search, mode6);
    take(mode6, fit);
  } else {
    fitWithMode6(StoredBrick(targets, axis), search, fit);
  }
  improve(StoredBrick(targets, axis), search, fit);
  store(brick, encoding, targets.range, fit, out);
}

void encodeBc7BestAxis(const BrickSource& brick, int effort, Candidate& out) {
  const BrickTargets targets(brick);
  const Bc7Search search = bc7Search(effort);
  BrickFit fit[3];
  if (isQuick(search)) {
    const std::uint32_t promising = quickBestAxis(targets, search, fit[0]);
    improve(StoredBrick(targets, axisOf(promising)), search, fit[0]);
    store(brick, format::kEncodingBc7Z + promising, targets.range, fit[0], out);
    return;
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    const StoredBrick stored(targets, axisOf(i));
    fitWithMode6(stored, search, fit[i]);
    improve(stored, search, fit[i]);
  }
  const std::uint32_t best = leastError(fit);
  store(brick, format::kEncodingBc7Z + best, targets.range, fit[best], out);
}

}  // namespace billow::compiler
