#include "atlas.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace billow::runtime {
namespace {

struct ClassTraits {
  VkFormat format;
  std::uint32_t depth;      // texels along z of a slot
  std::uint32_t blockSide;  // texels along x and y of a block
  std::uint32_t blockBytes;
};

const ClassTraits& traits(BrickStore which) {
  static constexpr ClassTraits kTraits[kAtlasCount] = {{VK_FORMAT_BC7_UNORM_BLOCK, 2, 4, 16},
                                                       {VK_FORMAT_R8_UNORM, 8, 1, 1}};
  return kTraits[static_cast<std::uint32_t>(which)];
}

// Copies a slot's rows of blocks; `source` holds them slice by slice.
void copyRows(const AtlasShape& shape, std::uint32_t slot, const std::byte* source, std::span<std::byte> image) {
  const ClassTraits& kind = traits(shape.which);
  const std::size_t side = 8 / kind.blockSide;
  const std::size_t rowBytes = side * kind.blockBytes;
  const std::size_t x = slot & ((1u << shape.xBits) - 1);
  const std::size_t y = slot >> shape.xBits & ((1u << shape.yBits) - 1);
  const std::size_t z = slot >> (shape.xBits + shape.yBits);
  const std::size_t imageRow = rowBytes << shape.xBits;
  const std::size_t imageRows = side << shape.yBits;
  for (std::size_t slice = 0; slice < kind.depth; ++slice) {
    for (std::size_t row = 0; row < side; ++row) {
      const std::size_t to = ((z * kind.depth + slice) * imageRows + y * side + row) * imageRow + x * rowBytes;
      std::memcpy(image.subspan(to, rowBytes).data(), source, rowBytes);
      source += rowBytes;
    }
  }
}

void writeDecoded(const AtlasShape& shape, const StoredBrick& brick, std::span<std::byte> image) {
  format::Texels texels;
  format::decodeTexels(brick.encoding, brick.bytes, texels);
  std::byte raw[format::kBrickVoxels];
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    raw[i] = static_cast<std::byte>(texels[format::voxelIndex(i & 7, i >> 3 & 7, i >> 6)]);
  }
  copyRows(shape, brick.slot, raw, image);
}

}  // namespace

VkFormat AtlasShape::format() const {
  return traits(which).format;
}

VkExtent3D AtlasShape::extent() const {
  return {8u << xBits, 8u << yBits, layers * traits(which).depth};
}

std::uint64_t AtlasShape::bytes() const {
  const ClassTraits& kind = traits(which);
  const std::uint64_t blocks = (8 / kind.blockSide) * (8 / kind.blockSide) * kind.depth;
  return (std::uint64_t{layers} << (xBits + yBits)) * blocks * kind.blockBytes;
}

std::optional<AtlasShape> atlasShape(BrickStore which, std::uint32_t slots, std::uint32_t maxExtent) {
  const std::uint32_t maxLayers = maxExtent / traits(which).depth;
  const std::uint32_t maxBits = static_cast<std::uint32_t>(std::bit_width(maxExtent / 8) - 1);
  // A layer is at most 1/16 of the atlas, which bounds the slots that stay unused in the last one.
  const std::uint32_t wanted = static_cast<std::uint32_t>(std::max(0, int(std::bit_width(slots)) - 5));
  for (std::uint32_t bits = wanted; bits <= 2 * maxBits; ++bits) {
    AtlasShape shape{.which = which, .xBits = (bits + 1) / 2, .yBits = bits / 2, .layers = 0};
    shape.layers = static_cast<std::uint32_t>((std::uint64_t{slots} + (1u << bits) - 1) >> bits);
    if (shape.layers <= maxLayers) return shape;
  }
  return std::nullopt;
}

void writeSlot(const AtlasShape& shape, const StoredBrick& brick, std::span<std::byte> image) {
  if (shape.which == BrickStore::r8 && brick.encoding < format::kEncodingR8) {
    writeDecoded(shape, brick, image);
    return;
  }
  copyRows(shape, brick.slot, brick.bytes.data(), image);
  if (brick.encoding == format::kEncodingR16) copyRows(shape, brick.slot + 1, brick.bytes.data() + 512, image);
}

}  // namespace billow::runtime
