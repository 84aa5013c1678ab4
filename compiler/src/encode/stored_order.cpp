#include "encode/stored_order.h"

namespace billow::compiler {

StoredBrick::StoredBrick(const BrickTargets& targets, std::uint32_t packedAxis) : allActive_(targets.allActive) {
  // Strides in voxelIndex of the stored x, y and z.
  const std::uint32_t strideX = packedAxis == 0 ? 1 : 64;
  const std::uint32_t strideY = packedAxis == 1 ? 1 : 8;
  const std::uint32_t strideZ = packedAxis == 0 ? 64 : packedAxis == 1 ? 8 : 1;
  std::uint32_t to = 0;
  for (std::uint32_t z = 0; z < 8; ++z) {
    for (std::uint32_t y = 0; y < 8; ++y) {
      for (std::uint32_t x = 0; x < 8; ++x, ++to) {
        const std::uint32_t from = x * strideX + y * strideY + z * strideZ;
        value_[to] = targets.value[from];
        weight_[to] = allActive_ ? 1.0f : targets.weight[from];
      }
    }
  }
}

Plane StoredBrick::plane(std::uint32_t block) const {
  const std::uint32_t corner = (block >> 2) * 256 + (block >> 1 & 1) * 32 + (block & 1) * 4;
  Plane plane;
  plane.uniform = allActive_;
  for (std::uint32_t c = 0; c < 4; ++c) {
    for (std::uint32_t r = 0; r < 4; ++r) {
      plane.value[c][r] = load(value_ + corner + 64 * c + 8 * r);
      plane.weight[c][r] = load(weight_ + corner + 64 * c + 8 * r);
    }
  }
  return plane;
}

}  // namespace billow::compiler
