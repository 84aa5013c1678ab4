// Bricks on the CPU: from stored bytes to texels to values, exactly as the GPU reconstructs them.
#ifndef BILLOW_FORMAT_BRICK_H
#define BILLOW_FORMAT_BRICK_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "billow/format/layout.h"

namespace billow::format {

// Index of voxel (x, y, z) in a brick's arrays on the CPU and in its mask: x * 64 + y * 8 + z.
constexpr std::uint32_t voxelIndex(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return x << 6 | y << 3 | z;
}

constexpr std::uint32_t encodingOf(const Node3& node) {
  return node.brick >> kEncodingShift;
}
constexpr std::uint32_t unitOf(const Node3& node) {
  return node.brick & kBrickUnitMask;
}

// Stored bytes of a brick: 0, 128, 256, 512 or 1024; nullopt for an unknown encoding.
constexpr std::optional<std::uint32_t> brickBytes(std::uint32_t encoding) {
  if (encoding == kEncodingConstant) return 0;
  if (encoding <= kEncodingBc7X) return 128;
  if (encoding <= kEncodingBc4X) return 256;
  if (encoding == kEncodingR8) return 512;
  if (encoding == kEncodingR16) return 1024;
  return std::nullopt;
}

// 64-byte units of a stored brick; 0 for a constant and for an unknown encoding.
constexpr std::uint32_t brickUnits(std::uint32_t encoding) {
  return brickBytes(encoding).value_or(0) / kBrickUnitBytes;
}

// Class of a known encoding other than constant.
constexpr BrickClass brickClass(std::uint32_t encoding) {
  if (encoding <= kEncodingBc7X) return BrickClass::bc7;
  if (encoding <= kEncodingBc4X) return BrickClass::bc4;
  return encoding == kEncodingR8 ? BrickClass::r8 : BrickClass::r16;
}

// Which axis (0 x, 1 y, 2 z) changes places with z when the brick is stored; 2 where none does.
constexpr std::uint32_t packedAxis(std::uint32_t encoding) {
  if (encoding == kEncodingBc7Y || encoding == kEncodingBc4Y) return 1;
  if (encoding == kEncodingBc7X || encoding == kEncodingBc4X) return 0;
  return 2;
}

using Texels = std::array<std::uint16_t, kBrickVoxels>;  // by voxelIndex
using Values = std::array<float, kBrickVoxels>;          // by voxelIndex

// Decodes a stored brick into integer texels. `bytes` must hold brickBytes(encoding); any bytes are valid.
// BC7: modes 0 to 7 by the Khronos Data Format Specification; the reserved mode gives 0 in all channels.
// BC4: the interpolated value rounded to the nearest integer of [0, 255] (never half-way).
void decodeTexels(std::uint32_t encoding, std::span<const std::byte> bytes, Texels& texels);

// One BC7 block of 16 bytes to 16 RGBA texels (row by row).
void decodeBc7Block(const std::byte* block, std::uint8_t rgba[16][4]);
// One BC4 unsigned block of 8 bytes to 16 texels (row by row).
void decodeBc4Block(const std::byte* block, std::uint8_t texels[16]);

// The reconstruction rule, one rounding a step: float(lo + float(scale * texel)).
// Compiled without contraction, so that every build and the GPU agree to the bit.
float reconstruct(float lo, float scale, std::uint32_t texel);

// Bit of voxelIndex `index` in a mask.
constexpr bool maskBit(const Mask3& mask, std::uint32_t index) {
  return (mask.words[index >> 5] >> (index & 31) & 1u) != 0;
}

// All 512 values and the active mask of a Node3. `mask` is read only where node.mask is an index; `brick` holds
// brickBytes(encoding) bytes; inactive voxels become `background`, the grid frame's.
void decodeBrick(const Node3& node, const Mask3* mask, std::span<const std::byte> brick, float background,
                 Values& values, Mask3& active);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_BRICK_H
