// BC4 bricks: 32 blocks of 16 scalars, each with two 8-bit endpoints and 3-bit steps between them.
#include "encode/wide/wide_encoder.h"

namespace billow::compiler {
namespace {

constexpr std::uint32_t kBytes = 256;

void store(const BrickSource& brick, std::uint32_t encoding, const WideBrick& arranged, TexelRange range,
           Candidate& out) {
  out.encoding = encoding;
  out.texelMask = false;
  out.lo = range.lo;
  out.scale = range.scale;
  wideEncoder().encodeBc4(arranged, out.payload.data());
  format::Texels texels;
  format::decodeTexels(encoding, {out.payload.data(), kBytes}, texels);
  wideEncoder().measure(brick, texels, out);
}

}  // namespace

void encodeBc4(const BrickSource& brick, std::uint32_t encoding, Candidate& out) {
  const BrickTargets targets(brick);
  WideBrick arranged;
  wideEncoder().arrange(targets, format::packedAxis(encoding), arranged);
  store(brick, encoding, arranged, targets.range, out);
}

void encodeBc4BestAxis(const BrickSource& brick, Candidate& out) {
  const BrickTargets targets(brick);
  WideBrick arranged[3];
  std::uint32_t best = 0;
  float least = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    wideEncoder().arrange(targets, format::packedAxis(format::kEncodingBc4Z + i), arranged[i]);
    const float spread = wideEncoder().bc4Spread(arranged[i]);
    if (i == 0 || spread < least) {
      least = spread;
      best = i;
    }
  }
  store(brick, format::kEncodingBc4Z + best, arranged[best], targets.range, out);
}

}  // namespace billow::compiler
