// Displacement over the directions of a sphere: a cube map of 64x64 texels a face with all its mips, as BC4 blocks.
#ifndef BILLOW_FORMAT_CUBE_MAP_H
#define BILLOW_FORMAT_CUBE_MAP_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace billow::format {

inline constexpr std::uint32_t kCubeEdge = 64;
inline constexpr std::uint32_t kCubeFaces = 6;
inline constexpr std::uint32_t kCubeLevels = 7;  // 64, 32, ... 1 texels
inline constexpr std::uint32_t kBc4Bytes = 8;

// Blocks along an edge of a level.
constexpr std::uint32_t cubeBlocks(std::uint32_t level) {
  const std::uint32_t edge = kCubeEdge >> level;
  return edge < 4 ? 1 : edge / 4;
}
// Bytes before a level; `level` kCubeLevels: of all.
constexpr std::uint32_t cubeLevelOffset(std::uint32_t level) {
  std::uint32_t bytes = 0;
  for (std::uint32_t l = 0; l < level; ++l) bytes += cubeBlocks(l) * cubeBlocks(l) * kCubeFaces * kBc4Bytes;
  return bytes;
}
inline constexpr std::uint32_t kCubeBytes = cubeLevelOffset(kCubeLevels);
static_assert(kCubeBytes == 16464);

// As a section holds it: level by level from the largest, of a level face by face in the order of CubeFace, of a face
// its blocks row by row. Any bytes are a map.
struct CubeMap {
  std::array<std::byte, kCubeBytes> blocks;
};
static_assert(sizeof(CubeMap) == kCubeBytes);

// One BC4 block, texels row by row, in [0, 1]: the unsigned format of Vulkan, its fractions exact.
void decodeBc4(std::span<const std::byte, kBc4Bytes> block, std::array<float, 16>& texels);

// +X, -X, +Y, -Y, +Z, -Z with the axes of Vulkan's cube images.
struct CubePoint {
  std::uint32_t face;
  float u, v;  // in [0, 1] across the face
};
// Where a direction, of any length but 0, meets the cube; for (0, 0, 0), the middle of +X.
CubePoint cubePoint(const std::array<float, 3>& direction);
// The direction, not normalised, of a point of a face; u and v may lie somewhat outside of [0, 1].
std::array<float, 3> cubeDirection(const CubePoint& point);

// The largest level of a cube map as numbers, to be read between texels.
class DecodedCube {
 public:
  explicit DecodedCube(const CubeMap& map);

  // Linear between the four nearest texels, across the edges of faces too; in [0, 1].
  float sample(const std::array<float, 3>& direction) const;
  float texel(std::uint32_t face, std::uint32_t x, std::uint32_t y) const {
    return texels_[(face * kCubeEdge + y) * kCubeEdge + x];
  }
  // The same for x and y from -1 to kCubeEdge: beyond an edge, the texel of the next face that lies there.
  float texelAround(std::uint32_t face, int x, int y) const;

 private:
  std::vector<float> texels_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_CUBE_MAP_H
