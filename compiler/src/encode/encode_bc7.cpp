// BC7 bricks: eight blocks of 16 texels, four slices of the packed axis in a texel's channels.
#include <cmath>

#include "encode/bc7_block.h"

namespace billow::compiler {
namespace {

constexpr std::uint32_t kBlocks = 8;
constexpr std::uint32_t kBlockBytes = 16;

std::uint32_t axisOf(std::uint32_t i) {
  return format::packedAxis(format::kEncodingBc7Z + i);
}

float totalError(const Bc7Fits& fits) {
  float total = 0;
  for (const float error : fits.error) total += error;
  return total;
}

// Betters what mode 6 fitted.
void tryOtherModes(const BlockTexels& texels, const Bc7Search& search, Bc7Fits& fits) {
  if (search.rotations > 0 && totalError(fits) > 0) tryModes4And5(texels, search, fits);
  if (search.partitions > 0 && totalError(fits) > 0) tryMode7(texels, search, fits);
}

// Fills `out`; `texels` are what its blocks decode to.
void store(const BrickSource& brick, std::uint32_t encoding, TexelRange range, const Bc7Fits& fits,
           format::Texels& texels, Candidate& out) {
  out.encoding = encoding;
  out.texelMask = false;
  out.lo = range.lo;
  out.scale = range.scale;
  for (std::uint32_t b = 0; b < kBlocks; ++b) packBlock(fits, b, &out.payload[b * kBlockBytes]);
  format::decodeTexels(encoding, {out.payload.data(), kBlocks * kBlockBytes}, texels);
  measure(brick, texels, out);
}

// The lo and scale with which these texels come nearest to the active voxels: a linear regression. Those of `fallback`
// where it has no solution that a pack may hold.
TexelRange solveRange(const BrickSource& brick, const format::Texels& texels, TexelRange fallback) {
  double count = 0, sumT = 0, sumTT = 0, sumV = 0, sumTV = 0;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    if (!format::maskBit(*brick.active, i)) continue;
    const double t = texels[i];
    // About lo, for the sake of precision.
    const double v = static_cast<double>((*brick.values)[i]) - static_cast<double>(fallback.lo);
    count += 1;
    sumT += t;
    sumTT += t * t;
    sumV += v;
    sumTV += t * v;
  }
  const double determinant = count * sumTT - sumT * sumT;
  if (!(determinant > 0)) return fallback;
  const double scale = (count * sumTV - sumT * sumV) / determinant;
  const double lo = (sumV - scale * sumT) / count + static_cast<double>(fallback.lo);
  const TexelRange range = {static_cast<float>(lo), static_cast<float>(scale)};
  const bool usable =
      range.scale > 0 && std::isfinite(range.lo) && std::isfinite(format::reconstruct(range.lo, range.scale, 255));
  return usable ? range : fallback;
}

// The blocks and the brick's range in turns: each makes the other's best anew.
void solveTogether(const BrickSource& brick, const Bc7Search& search, format::Texels& texels, Candidate& out) {
  const std::uint32_t axis = format::packedAxis(out.encoding);
  for (int round = 0; round < search.ranges && out.squaredError > 0; ++round) {
    Candidate solved = out;
    const TexelRange range = solveRange(brick, texels, {out.lo, out.scale});
    solved.lo = range.lo;
    solved.scale = range.scale;
    measure(brick, texels, solved);
    if (solved.squaredError < out.squaredError) out = solved;
    const BrickTargets targets(brick, range);
    BlockTexels arranged;
    arrange(targets, axis, arranged);
    Bc7Fits fits;
    fitMode6(arranged, search, fits);
    tryOtherModes(arranged, search, fits);
    store(brick, out.encoding, range, fits, texels, solved);
    if (!(solved.squaredError < out.squaredError)) return;
    out = solved;
  }
}

void encodeAxis(const BrickSource& brick, const BrickTargets& targets, std::uint32_t encoding, const Bc7Search& search,
                Candidate& out) {
  BlockTexels arranged;
  arrange(targets, format::packedAxis(encoding), arranged);
  Bc7Fits fits;
  fitMode6(arranged, search, fits);
  tryOtherModes(arranged, search, fits);
  format::Texels texels;
  store(brick, encoding, targets.range, fits, texels, out);
  solveTogether(brick, search, texels, out);
}

// Of the three packed axes only the one that mode 6 serves best goes on to the other modes.
void encodePromisingAxis(const BrickSource& brick, const BrickTargets& targets, const Bc7Search& search,
                         Candidate& out) {
  BlockTexels arranged[3];
  Bc7Fits fits[3];
  std::uint32_t best = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    arrange(targets, axisOf(i), arranged[i]);
    fitMode6(arranged[i], search, fits[i]);
    if (totalError(fits[i]) < totalError(fits[best])) best = i;
  }
  tryOtherModes(arranged[best], search, fits[best]);
  format::Texels texels;
  store(brick, format::kEncodingBc7Z + best, targets.range, fits[best], texels, out);
}

}  // namespace

void encodeBc7(const BrickSource& brick, std::uint32_t encoding, int effort, Candidate& out) {
  encodeAxis(brick, BrickTargets(brick), encoding, bc7Search(effort), out);
}

void encodeBc7BestAxis(const BrickSource& brick, int effort, Candidate& out) {
  const BrickTargets targets(brick);
  const Bc7Search search = bc7Search(effort);
  if (!search.everyAxis) {
    encodePromisingAxis(brick, targets, search, out);
    return;
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    Candidate candidate;
    encodeAxis(brick, targets, format::kEncodingBc7Z + i, search, candidate);
    if (i == 0 || candidate.squaredError < out.squaredError) out = candidate;
  }
}

}  // namespace billow::compiler
