#include "billow/format/brick.h"

namespace billow::format {
namespace {

// Distance in voxelIndex between neighbours along the stored x, y and z.
struct Strides {
  std::uint32_t x, y, z;
};

Strides storedStrides(std::uint32_t encoding) {
  switch (packedAxis(encoding)) {
    case 0:
      return {1, 8, 64};
    case 1:
      return {64, 1, 8};
    default:
      return {64, 8, 1};
  }
}

void decodeBc7(std::uint32_t encoding, const std::byte* bytes, Texels& texels) {
  const Strides stride = storedStrides(encoding);
  for (std::uint32_t block = 0; block < 8; ++block) {
    std::uint8_t rgba[16][4];
    decodeBc7Block(bytes + 16 * block, rgba);
    std::uint16_t* corner =
        &texels[(block & 1) * 4 * stride.x + (block >> 1 & 1) * 4 * stride.y + (block >> 2) * 4 * stride.z];
    for (std::uint32_t i = 0; i < 16; ++i) {
      std::uint16_t* texel = corner + (i & 3) * stride.x + (i >> 2) * stride.y;
      for (std::uint32_t c = 0; c < 4; ++c) texel[c * stride.z] = rgba[i][c];
    }
  }
}

void decodeBc4(std::uint32_t encoding, const std::byte* bytes, Texels& texels) {
  const Strides stride = storedStrides(encoding);
  for (std::uint32_t block = 0; block < 32; ++block) {
    std::uint8_t decoded[16];
    decodeBc4Block(bytes + 8 * block, decoded);
    std::uint16_t* corner =
        &texels[(block & 1) * 4 * stride.x + (block >> 1 & 1) * 4 * stride.y + (block >> 2) * stride.z];
    for (std::uint32_t i = 0; i < 16; ++i) corner[(i & 3) * stride.x + (i >> 2) * stride.y] = decoded[i];
  }
}

// Raw texels, x fastest; `high` is null where a texel is one byte.
void decodeRaw(const std::byte* low, const std::byte* high, Texels& texels) {
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    std::uint32_t texel = std::to_integer<std::uint32_t>(low[i]);
    if (high != nullptr) texel |= std::to_integer<std::uint32_t>(high[i]) << 8;
    texels[voxelIndex(i & 7, i >> 3 & 7, i >> 6)] = static_cast<std::uint16_t>(texel);
  }
}

void activeFromTexels(const Texels& texels, Mask3& active) {
  active = {};
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    if (texels[i] != 0) active.words[i >> 5] |= 1u << (i & 31);
  }
}

}  // namespace

void decodeTexels(std::uint32_t encoding, std::span<const std::byte> bytes, Texels& texels) {
  if (encoding >= kEncodingBc7Z && encoding <= kEncodingBc7X) {
    decodeBc7(encoding, bytes.data(), texels);
  } else if (encoding >= kEncodingBc4Z && encoding <= kEncodingBc4X) {
    decodeBc4(encoding, bytes.data(), texels);
  } else if (encoding == kEncodingR8) {
    decodeRaw(bytes.data(), nullptr, texels);
  } else if (encoding == kEncodingR16) {
    decodeRaw(bytes.data(), bytes.data() + kBrickVoxels, texels);
  } else {
    texels.fill(0);
  }
}

float reconstruct(float lo, float scale, std::uint32_t texel) {
  const float product = scale * static_cast<float>(texel);
  return lo + product;
}

void decodeBrick(const Node3& node, const Mask3* mask, std::span<const std::byte> brick, float background,
                 Values& values, Mask3& active) {
  Texels texels;
  decodeTexels(encodingOf(node), brick, texels);
  if (node.mask == kMaskTexel) {
    activeFromTexels(texels, active);
  } else if (node.mask == kMaskAll) {
    for (std::uint32_t& word : active.words) word = 0xffffffffu;
  } else {
    active = *mask;
  }
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    values[i] = maskBit(active, i) ? reconstruct(node.lo, node.scale, texels[i]) : background;
  }
}

}  // namespace billow::format
