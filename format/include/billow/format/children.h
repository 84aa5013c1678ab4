// How a node's children lie: child (x, y, z) of (1 << log2)^3 is bit x << 2 * log2 | y << log2 | z of its mask, and a
// child spans 1 << childSpanLog2 voxels an axis (layout.h has both numbers of each kind of node).
#ifndef BILLOW_FORMAT_CHILDREN_H
#define BILLOW_FORMAT_CHILDREN_H

#include <array>
#include <cstdint>
#include <span>

namespace billow::format {

// The bit of the child that holds the voxel `at`, in pack index space.
constexpr std::uint32_t childBit(std::span<const std::uint32_t, 3> at, std::uint32_t log2,
                                 std::uint32_t childSpanLog2) {
  const std::uint32_t last = (1u << log2) - 1;
  return (at[0] >> childSpanLog2 & last) << 2 * log2 | (at[1] >> childSpanLog2 & last) << log2 |
         (at[2] >> childSpanLog2 & last);
}

// The first voxel of the child at `bit`, relative to the node's own.
constexpr std::array<std::uint32_t, 3> childOrigin(std::uint32_t bit, std::uint32_t log2, std::uint32_t childSpanLog2) {
  const std::uint32_t last = (1u << log2) - 1;
  return {(bit >> 2 * log2) << childSpanLog2, (bit >> log2 & last) << childSpanLog2, (bit & last) << childSpanLog2};
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_CHILDREN_H
