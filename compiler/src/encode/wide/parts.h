// The parts of one WideEncoder, in the namespace of the instructions that they are compiled for.
#ifndef BILLOW_COMPILER_ENCODE_WIDE_PARTS_H
#define BILLOW_COMPILER_ENCODE_WIDE_PARTS_H

#include "encode/wide/lanes.h"
#include "encode/wide/wide_encoder.h"

namespace billow::compiler::BILLOW_WIDE {

ValueRange activeRange(const BrickSource& brick);
void texelTargets(const BrickSource& brick, TexelRange range, std::uint32_t first, std::uint32_t last,
                  TexelTargets& targets);
void texelWeights(const BrickSource& brick, TexelWeights& weights);
void measure(const BrickSource& brick, const format::Texels& texels, Candidate& candidate);
void arrange(const BrickTargets& targets, std::uint32_t packedAxis, WideBrick& wide);
float bc4Spread(const WideBrick& wide);
void encodeBc4(const WideBrick& wide, std::byte* payload);
float fitMode6(const WideBrick& wide, int passes, WideMode6& fit);

}  // namespace billow::compiler::BILLOW_WIDE

#endif  // BILLOW_COMPILER_ENCODE_WIDE_PARTS_H
