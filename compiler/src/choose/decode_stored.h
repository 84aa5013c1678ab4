// What readers will make of a brick, by their very decoder.
#ifndef BILLOW_COMPILER_CHOOSE_DECODE_STORED_H
#define BILLOW_COMPILER_CHOOSE_DECODE_STORED_H

#include <span>

#include "billow/format/brick.h"

namespace billow::compiler {

// `brick` is a ChosenBrick or a Candidate, with a payload of its encoding's size at least; `mask` its leaf's.
template <class Brick>
void decodeStored(const Brick& brick, const format::Mask3& mask, float background, format::Values& values) {
  format::Node3 node{};
  node.brick = brick.encoding << format::kEncodingShift;
  node.mask = brick.texelMask ? format::kMaskTexel : 0;
  node.lo = brick.lo;
  node.scale = brick.scale;
  format::Mask3 active;
  const std::span<const std::byte> payload(brick.payload.data(), *format::brickBytes(brick.encoding));
  format::decodeBrick(node, &mask, payload, background, values, active);
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_CHOOSE_DECODE_STORED_H
