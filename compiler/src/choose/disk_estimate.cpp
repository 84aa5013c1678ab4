#include "choose/disk_estimate.h"

#include "encode/index_bits.h"

namespace billow::compiler {
namespace {

// A mask, and a node with its place in a child list, in compressed pages of real smoke and fire.
constexpr std::uint32_t kMaskBytes = 14;
constexpr std::uint32_t kNodeBytes = 4;

// Of a brick in BC7 and in coarse, in such pages.
constexpr std::uint32_t kBc7Bytes = 108;
constexpr std::uint32_t kCoarseBytes = 58;

std::uint32_t bytesOf(std::uint32_t bits256) {
  return (bits256 + 2047) / 2048;
}

// Of 16 bits the high ones are coded like indices of 8 bits, the low ones as they are.
std::uint32_t wideBytes(format::Texels& indices, const format::Mask3& active) {
  for (std::uint16_t& index : indices) index = static_cast<std::uint16_t>(index >> 8);
  return format::kBrickVoxels + bytesOf(indicesBits256(indices, active, {0, 255}));
}

std::uint32_t payloadBytes(const Candidate& candidate, const format::Mask3& active) {
  if (format::isBc7(candidate.encoding)) return kBc7Bytes;
  if (candidate.encoding == format::kEncodingCoarse) return kCoarseBytes;
  const std::uint32_t bits = format::indexBits(candidate.encoding);
  if (bits == 0) return 0;
  format::Texels indices;
  format::decodeTexels(candidate.encoding, {candidate.payload.data(), *format::brickBytes(candidate.encoding)},
                       indices);
  if (bits == 16) return wideBytes(indices, active);
  const IndexRange range{candidate.texelMask ? 1 : 0, (1 << bits) - 1};
  return bytesOf(indicesBits256(indices, active, range));
}

}  // namespace

std::uint32_t estimateDiskBytes(const Candidate& candidate, const format::Mask3& active, bool hasMask) {
  return kNodeBytes + (hasMask ? kMaskBytes : 0) + payloadBytes(candidate, active);
}

std::uint32_t diskBytesOfIndices(std::uint32_t bits256, bool hasMask) {
  return kNodeBytes + (hasMask ? kMaskBytes : 0) + bytesOf(bits256);
}

}  // namespace billow::compiler
