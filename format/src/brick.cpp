#include "billow/format/brick.h"

#include <utility>

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

void unpackIndices(const std::byte* bytes, std::uint32_t bits, Texels& indices) {
  // Eight indices begin and end at whole bytes, and fit one word; four do where they have 16 bits.
  const std::uint32_t step = bits == 16 ? 4 : 8;
  const std::uint64_t last = (1u << bits) - 1;
  for (std::uint32_t i = 0; i < kBrickVoxels; i += step, bytes += step * bits / 8) {
    std::uint64_t word = 0;
    for (std::uint32_t b = 0; b < step * bits / 8; ++b) word |= std::to_integer<std::uint64_t>(bytes[b]) << (8 * b);
    for (std::uint32_t k = 0; k < step; ++k) indices[i + k] = static_cast<std::uint16_t>(word >> (k * bits) & last);
  }
}

// What index i of a cell with these ends stands for; `last` is the largest index.
std::uint32_t localTexel(const std::byte* cell, std::uint32_t last, std::uint32_t index) {
  const auto base = std::to_integer<std::uint32_t>(cell[0]);
  const auto top = std::to_integer<std::uint32_t>(cell[1]);
  return base * (last - index) + top * index;
}

void decodeLocal(const std::byte* bytes, std::uint32_t bits, Texels& texels) {
  unpackIndices(bytes + kLocalCellBytes, bits, texels);
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    const std::byte* cell = bytes + 2 * localCell(i >> 6, i >> 3 & 7, i & 7);
    texels[i] = static_cast<std::uint16_t>(localTexel(cell, (1u << bits) - 1, texels[i]));
  }
}

// The two of four values along an axis that a voxel lies between, and their weights in quarters.
struct Taps {
  std::uint32_t at[2];
  std::uint32_t weight[2];
};

constexpr Taps coarseTaps(std::uint32_t voxel) {
  const std::uint32_t after = (voxel + 1) >> 1;  // one more than floor((voxel - 0.5) / 2)
  const std::uint32_t near = (voxel & 1) != 0 ? 1 : 3;
  return {{after == 0 ? 0 : after - 1, after > 3 ? 3 : after}, {4 - near, near}};
}

std::uint32_t coarseTexel(const std::byte* bytes, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const Taps X = coarseTaps(x), Y = coarseTaps(y), Z = coarseTaps(z);
  std::uint32_t sum = 0;
  for (std::uint32_t tap = 0; tap < 8; ++tap) {
    const std::uint32_t i = tap >> 2, j = tap >> 1 & 1, k = tap & 1;
    const auto value = std::to_integer<std::uint32_t>(bytes[(X.at[i] * 4 + Y.at[j]) * 4 + Z.at[k]]);
    sum += value * X.weight[i] * Y.weight[j] * Z.weight[k];
  }
  return sum;
}

// Four items an axis become eight, `inner` numbers apart, `outer` times over: coarseTexel's sum, an axis at a time.
void expandAxis(const std::uint16_t* from, std::uint32_t outer, std::uint32_t inner, std::uint16_t* to) {
  for (std::uint32_t o = 0; o < outer; ++o, from += 4 * inner) {
    for (std::uint32_t voxel = 0; voxel < 8; ++voxel) {
      const Taps taps = coarseTaps(voxel);
      for (std::uint32_t i = 0; i < inner; ++i) {
        const std::uint32_t sum =
            taps.weight[0] * from[taps.at[0] * inner + i] + taps.weight[1] * from[taps.at[1] * inner + i];
        *to++ = static_cast<std::uint16_t>(sum);
      }
    }
  }
}

void decodeCoarse(const std::byte* bytes, Texels& texels) {
  std::uint16_t points[4 * 4 * 4], x[8 * 4 * 4], y[8 * 8 * 4];
  for (std::uint32_t i = 0; i < 64; ++i) points[i] = std::to_integer<std::uint16_t>(bytes[i]);
  expandAxis(points, 1, 16, x);
  expandAxis(x, 8, 4, y);
  expandAxis(y, 64, 1, texels.data());
}

std::uint32_t bc7Texel(std::uint32_t encoding, const std::byte* bytes, std::array<std::uint32_t, 3> at) {
  std::swap(at[packedAxis(encoding)], at[2]);
  const auto [x, y, z] = at;
  std::uint8_t rgba[16][4];
  decodeBc7Block(bytes + ((z >> 2) * 4 + (y >> 2) * 2 + (x >> 2)) * 16, rgba);
  return rgba[(y & 3) * 4 + (x & 3)][z & 3];
}

void activeFromIndices(std::uint32_t encoding, std::span<const std::byte> bytes, Mask3& active) {
  Texels indices;
  unpackIndices(bytes.data() + (isLocal(encoding) ? kLocalCellBytes : 0), indexBits(encoding), indices);
  active = {};
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    if (indices[i] != 0) active.words[i >> 5] |= 1u << (i & 31);
  }
}

}  // namespace

void decodeTexels(std::uint32_t encoding, std::span<const std::byte> bytes, Texels& texels) {
  if (isBc7(encoding)) {
    decodeBc7(encoding, bytes.data(), texels);
  } else if (encoding == kEncodingCoarse) {
    decodeCoarse(bytes.data(), texels);
  } else if (isLocal(encoding)) {
    decodeLocal(bytes.data(), indexBits(encoding), texels);
  } else if (indexBits(encoding) != 0) {
    unpackIndices(bytes.data(), indexBits(encoding), texels);
  } else {
    texels.fill(0);
  }
}

std::uint32_t decodeTexel(std::uint32_t encoding, std::span<const std::byte> bytes, std::uint32_t x, std::uint32_t y,
                          std::uint32_t z) {
  if (isBc7(encoding)) return bc7Texel(encoding, bytes.data(), {x, y, z});
  if (encoding == kEncodingCoarse) return coarseTexel(bytes.data(), x, y, z);
  const std::uint32_t bits = indexBits(encoding);
  if (bits == 0) return 0;
  const std::uint32_t index = decodeIndex(encoding, bytes, voxelIndex(x, y, z));
  return isLocal(encoding) ? localTexel(bytes.data() + 2 * localCell(x, y, z), (1u << bits) - 1, index) : index;
}

std::uint32_t decodeIndex(std::uint32_t encoding, std::span<const std::byte> bytes, std::uint32_t voxel) {
  const std::uint32_t bits = indexBits(encoding);
  const std::uint32_t bit = (isLocal(encoding) ? kLocalCellBytes * 8 : 0) + voxel * bits;
  std::uint32_t word = std::to_integer<std::uint32_t>(bytes[bit >> 3]);
  if ((bit & 7) + bits > 8) word |= std::to_integer<std::uint32_t>(bytes[(bit >> 3) + 1]) << 8;
  return word >> (bit & 7) & ((1u << bits) - 1);
}

void packIndices(const Texels& indices, std::uint32_t bits, std::byte* bytes) {
  const std::uint32_t step = bits == 16 ? 4 : 8;
  for (std::uint32_t i = 0; i < kBrickVoxels; i += step) {
    std::uint64_t word = 0;
    for (std::uint32_t k = 0; k < step; ++k) word |= std::uint64_t{indices[i + k]} << (k * bits);
    for (std::uint32_t b = 0; b < step * bits / 8; ++b) *bytes++ = static_cast<std::byte>(word >> (8 * b) & 0xff);
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
    activeFromIndices(encodingOf(node), brick, active);
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
