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

constexpr bool isBc7(std::uint32_t encoding) {
  return encoding >= kEncodingBc7Z && encoding <= kEncodingBc7X;
}
constexpr bool isLocal(std::uint32_t encoding) {
  return encoding >= kEncodingLocal2 && encoding <= kEncodingLocal6;
}

// Bits of a voxel's stored index: of uniform and local bricks, which alone have indices; else 0.
constexpr std::uint32_t indexBits(std::uint32_t encoding) {
  if (encoding == kEncodingUniform16) return 16;
  if (encoding >= kEncodingUniform1 && encoding <= kEncodingUniform8) return encoding - kEncodingUniform1 + 1;
  return isLocal(encoding) ? encoding - kEncodingLocal2 + 2 : 0;
}

// Uniform of 1 to 8 or 16 bits, local of 2 to 6.
constexpr std::uint32_t uniformEncoding(std::uint32_t bits) {
  return bits == 16 ? kEncodingUniform16 : kEncodingUniform1 + bits - 1;
}
constexpr std::uint32_t localEncoding(std::uint32_t bits) {
  return kEncodingLocal2 + bits - 2;
}

// Bytes of a local brick's cells, before its indices.
inline constexpr std::uint32_t kLocalCells = 16;
inline constexpr std::uint32_t kLocalCellBytes = 2 * kLocalCells;

// Cell of a local brick that a voxel lies in: 4x4x2 voxels each.
constexpr std::uint32_t localCell(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return (x >> 2) << 3 | (y >> 2) << 2 | z >> 1;
}

// Stored bytes of a brick, a multiple of 32 up to 1024; nullopt for an unknown encoding.
constexpr std::optional<std::uint32_t> brickBytes(std::uint32_t encoding) {
  if (encoding == kEncodingConstant) return 0;
  if (isBc7(encoding)) return 128;
  if (encoding == kEncodingCoarse) return 64;
  if (encoding >= kEncodingCount) return std::nullopt;
  return (isLocal(encoding) ? kLocalCellBytes : 0) + kBrickVoxels / 8 * indexBits(encoding);
}

// 32-byte units of a stored brick; 0 for a constant and for an unknown encoding.
constexpr std::uint32_t brickUnits(std::uint32_t encoding) {
  return brickBytes(encoding).value_or(0) / kBrickUnitBytes;
}

// Class of a known encoding other than constant.
constexpr BrickClass brickClass(std::uint32_t encoding) {
  if (isBc7(encoding)) return BrickClass::bc7;
  if (encoding == kEncodingCoarse) return BrickClass::coarse;
  return isLocal(encoding) ? BrickClass::local : BrickClass::uniform;
}

// The largest texel that a brick of a known encoding can have; 255 for a constant, whose texels are 0.
constexpr std::uint32_t largestTexel(std::uint32_t encoding) {
  if (encoding == kEncodingCoarse) return 64 * 255;
  const std::uint32_t bits = indexBits(encoding);
  if (bits == 0) return 255;
  // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): it takes a constant to be local, of -11 bits
  return ((1u << bits) - 1) * (isLocal(encoding) ? 255 : 1);
}

// Which axis (0 x, 1 y, 2 z) changes places with z when the brick is stored; 2 where none does.
constexpr std::uint32_t packedAxis(std::uint32_t encoding) {
  return isBc7(encoding) ? kEncodingBc7X - encoding : 2;
}

using Texels = std::array<std::uint16_t, kBrickVoxels>;  // by voxelIndex
using Values = std::array<float, kBrickVoxels>;          // by voxelIndex

// Decodes a stored brick into integer texels. `bytes` must hold brickBytes(encoding); any bytes are valid.
// BC7: modes 0 to 7 by the Khronos Data Format Specification; the reserved mode gives 0 in all channels.
void decodeTexels(std::uint32_t encoding, std::span<const std::byte> bytes, Texels& texels);
// The same for one voxel.
std::uint32_t decodeTexel(std::uint32_t encoding, std::span<const std::byte> bytes, std::uint32_t x, std::uint32_t y,
                          std::uint32_t z);

// The stored index of a voxel of a uniform or local brick; `voxel` is its voxelIndex.
std::uint32_t decodeIndex(std::uint32_t encoding, std::span<const std::byte> bytes, std::uint32_t voxel);
// The reverse: writes `indices`, by voxelIndex and each below 2^bits, to kBrickVoxels / 8 * bits bytes.
void packIndices(const Texels& indices, std::uint32_t bits, std::byte* bytes);

// One BC7 block of 16 bytes to 16 RGBA texels (row by row).
void decodeBc7Block(const std::byte* block, std::uint8_t rgba[16][4]);

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
