#include "billow/format/cube_map.h"

#include <algorithm>
#include <cmath>

namespace billow::format {
namespace {

// Rows of a face's axes: major axis with its sign, then what u and v grow along (Vulkan 1.3, table "Cube map face and
// coordinate selection").
struct FaceAxes {
  int major, majorSign, uAxis, uSign, vAxis, vSign;
};
constexpr FaceAxes kFaces[kCubeFaces] = {
    {0, 1, 2, -1, 1, -1}, {0, -1, 2, 1, 1, -1}, {1, 1, 0, 1, 2, 1},
    {1, -1, 0, 1, 2, -1}, {2, 1, 0, 1, 1, -1},  {2, -1, 0, -1, 1, -1},
};

float mix(float a, float b, float share) {
  return a + (b - a) * share;
}

}  // namespace

void decodeBc4(std::span<const std::byte, kBc4Bytes> block, std::array<float, 16>& texels) {
  const auto first = std::to_integer<std::uint32_t>(block[0]);
  const auto second = std::to_integer<std::uint32_t>(block[1]);
  const std::uint32_t steps = first > second ? 7 : 5;
  std::array<float, 8> palette{};
  palette[7] = 1;  // in the mode of five steps: index 6 is 0, 7 is 1
  const auto scale = static_cast<float>(255 * steps);
  for (std::uint32_t i = 0; i <= steps; ++i) {
    const std::uint32_t share = i == 0 ? 0 : i == 1 ? steps : i - 1;
    palette[i] = static_cast<float>(first * (steps - share) + second * share) / scale;
  }
  std::uint64_t indices = 0;
  for (std::uint32_t i = 0; i < 6; ++i) indices |= std::to_integer<std::uint64_t>(block[2 + i]) << (8 * i);
  for (std::uint32_t i = 0; i < 16; ++i) texels[i] = palette[indices >> (3 * i) & 7];
}

CubePoint cubePoint(const std::array<float, 3>& direction) {
  const float x = std::abs(direction[0]), y = std::abs(direction[1]), z = std::abs(direction[2]);
  const std::size_t axis = z >= x && z >= y ? 2 : y >= x ? 1 : 0;
  const std::uint32_t face = static_cast<std::uint32_t>(axis) * 2 + (direction[axis] < 0 ? 1 : 0);
  const float major = std::abs(direction[axis]);
  if (!(major > 0)) return {0, 0.5f, 0.5f};
  const FaceAxes& axes = kFaces[face];
  const auto share = [&](int along, int sign) {
    return (static_cast<float>(sign) * direction[static_cast<std::size_t>(along)] / major + 1) / 2;
  };
  return {face, share(axes.uAxis, axes.uSign), share(axes.vAxis, axes.vSign)};
}

std::array<float, 3> cubeDirection(const CubePoint& point) {
  const FaceAxes& axes = kFaces[point.face];
  std::array<float, 3> direction{};
  direction[static_cast<std::size_t>(axes.major)] = static_cast<float>(axes.majorSign);
  direction[static_cast<std::size_t>(axes.uAxis)] = static_cast<float>(axes.uSign) * (2 * point.u - 1);
  direction[static_cast<std::size_t>(axes.vAxis)] = static_cast<float>(axes.vSign) * (2 * point.v - 1);
  return direction;
}

DecodedCube::DecodedCube(const CubeMap& map) : texels_(std::size_t{kCubeFaces} * kCubeEdge * kCubeEdge) {
  constexpr std::uint32_t kBlocks = cubeBlocks(0);
  for (std::uint32_t b = 0; b < kCubeFaces * kBlocks * kBlocks; ++b) {
    std::array<float, 16> block{};
    decodeBc4(std::span(map.blocks).subspan(std::size_t{b} * kBc4Bytes).first<kBc4Bytes>(), block);
    const std::uint32_t row = b / kBlocks * 4, column = b % kBlocks * 4;  // rows of all faces, one below the other
    for (std::uint32_t i = 0; i < 16; ++i) {
      texels_[std::size_t{row + i / 4} * kCubeEdge + column + i % 4] = block[i];
    }
  }
}

float DecodedCube::texelAround(std::uint32_t face, int x, int y) const {
  constexpr int kEdge = kCubeEdge;
  if (x >= 0 && x < kEdge && y >= 0 && y < kEdge) {
    return texel(face, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  }
  constexpr auto kScale = static_cast<float>(kEdge);
  const CubePoint there = cubePoint(
      cubeDirection({face, (static_cast<float>(x) + 0.5f) / kScale, (static_cast<float>(y) + 0.5f) / kScale}));
  const auto index = [&](float share) {
    return static_cast<std::uint32_t>(std::clamp(static_cast<int>(share * kScale), 0, kEdge - 1));
  };
  return texel(there.face, index(there.u), index(there.v));
}

float DecodedCube::sample(const std::array<float, 3>& direction) const {
  const CubePoint point = cubePoint(direction);
  const float x = point.u * static_cast<float>(kCubeEdge) - 0.5f, y = point.v * static_cast<float>(kCubeEdge) - 0.5f;
  const float left = std::floor(x), top = std::floor(y);
  const int ix = static_cast<int>(left), iy = static_cast<int>(top);
  const float upper = mix(texelAround(point.face, ix, iy), texelAround(point.face, ix + 1, iy), x - left);
  const float lower = mix(texelAround(point.face, ix, iy + 1), texelAround(point.face, ix + 1, iy + 1), x - left);
  return mix(upper, lower, y - top);
}

}  // namespace billow::format
