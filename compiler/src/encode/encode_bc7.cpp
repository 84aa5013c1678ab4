// BC7 bricks: eight blocks of 16 texels, four slices of the packed axis in a texel's channels.
#include "encode/bc7_block.h"
#include "encode/stored_order.h"
#include "encode/texel_range.h"

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
  measure(brick, texels, out);
}

}  // namespace

void encodeBc7(const BrickSource& brick, std::uint32_t encoding, int effort, Candidate& out) {
  const BrickTargets targets(brick);
  const StoredBrick stored(targets, format::packedAxis(encoding));
  const Bc7Search search = bc7Search(effort);
  BrickFit fit;
  fitWithMode6(stored, search, fit);
  improve(stored, search, fit);
  store(brick, encoding, targets.range, fit, out);
}

void encodeBc7BestAxis(const BrickSource& brick, int effort, Candidate& out) {
  const BrickTargets targets(brick);
  const StoredBrick stored[3] = {StoredBrick(targets, 2), StoredBrick(targets, 1), StoredBrick(targets, 0)};
  const Bc7Search search = bc7Search(effort);
  BrickFit fit[3];
  for (std::uint32_t i = 0; i < 3; ++i) fitWithMode6(stored[i], search, fit[i]);
  if (search.everyAxis) {
    for (std::uint32_t i = 0; i < 3; ++i) improve(stored[i], search, fit[i]);
  } else {
    const std::uint32_t promising = leastError(fit);
    improve(stored[promising], search, fit[promising]);
  }
  const std::uint32_t best = leastError(fit);
  store(brick, format::kEncodingBc7Z + best, targets.range, fit[best], out);
}

}  // namespace billow::compiler
