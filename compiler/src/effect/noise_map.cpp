#include "effect/noise_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "billow/format/exact_math.h"
#include "billow/format/noise.h"
#include "effect/bc4.h"
#include "effect/gradient_noise.h"
#include "parallel.h"

namespace billow::compiler {
namespace {

using Vec3 = std::array<double, 3>;

constexpr std::uint32_t kEdge = format::kCubeEdge;
constexpr std::size_t kFaceTexels = std::size_t{kEdge} * kEdge;
constexpr std::size_t kMapTexels = kFaceTexels * format::kCubeFaces;

// The distance to the nearest of one random point in each lattice cell (Worley 1996), at most about 1.
double cellNoise(const Vec3& p, std::uint32_t seed) {
  const Lattice l = latticeOf(p);
  double nearest = 4;
  for (int i = 0; i < 27; ++i) {
    const int cell[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
    std::uint32_t hash = format::hashPoint(l.at[0] + cell[0], l.at[1] + cell[1], l.at[2] + cell[2], seed);
    double square = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double away = cell[a] + static_cast<double>(format::unitOf(hash)) - l.share[a];
      square += away * away;
      hash = format::hashInteger(hash + 1);
    }
    nearest = std::min(nearest, square);
  }
  return std::sqrt(nearest);
}

double octave(NoiseKind kind, const Vec3& p, std::uint32_t seed) {
  switch (kind) {
    case NoiseKind::fbm:
      return gradientNoise(p, seed);
    case NoiseKind::ridged: {
      const double valley = std::abs(gradientNoise(p, seed));
      return (1 - valley) * (1 - valley);
    }
    case NoiseKind::worley:
      return 1 - cellNoise(p, seed);
  }
  return 0;
}

// Octaves of twice the frequency and half the height.
double layered(const NoiseMap& map, const Vec3& direction, std::uint32_t seed) {
  double sum = 0, frequency = map.frequency, height = 1;
  for (std::uint32_t o = 0; o < map.octaves; ++o) {
    const Vec3 p{direction[0] * frequency, direction[1] * frequency, direction[2] * frequency};
    sum += height * octave(map.kind, p, seed + o);
    frequency *= 2;
    height /= 2;
  }
  return sum;
}

Vec3 unitDirection(std::size_t texel) {
  const auto face = static_cast<std::uint32_t>(texel / kFaceTexels);
  const auto share = [](std::size_t i) { return (static_cast<float>(i) + 0.5f) / static_cast<float>(kEdge); };
  const auto d = format::cubeDirection({face, share(texel % kEdge), share(texel / kEdge % kEdge)});
  const Vec3 v{static_cast<double>(d[0]), static_cast<double>(d[1]), static_cast<double>(d[2])};
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

// Frames go round a circle of independent noises, every fourth frame one of them, and between them from one to the
// next. Blending flattens; the divisor restores the height.
constexpr std::uint32_t kFramesApart = 4;

double animated(const NoiseMap& map, const Vec3& direction, std::uint32_t frame) {
  if (map.frames == 1) return layered(map, direction, map.seed);
  const std::uint32_t count = (map.frames + kFramesApart - 1) / kFramesApart;
  const double at = static_cast<double>(frame) * count / map.frames;
  const auto first = static_cast<std::uint32_t>(at);
  const double share = fade(at - first);
  const auto seedOf = [&](std::uint32_t i) { return format::hashInteger(map.seed + i % count); };
  const double blend = mix(layered(map, direction, seedOf(first)), layered(map, direction, seedOf(first + 1)), share);
  return map.kind == NoiseKind::fbm ? blend / std::sqrt(share * share + (1 - share) * (1 - share)) : blend;
}

// Half the edge, each texel the mean of four.
std::vector<float> halved(const std::vector<float>& level, std::uint32_t edge) {
  const std::uint32_t half = edge / 2;
  std::vector<float> result(std::size_t{half} * half * format::kCubeFaces);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const std::size_t x = i % half * 2, y = i / half * 2;  // rows of all faces, one below the other
    const float* top = level.data() + y * edge + x;
    result[i] = (top[0] + top[1] + top[edge] + top[edge + 1]) / 4;
  }
  return result;
}

void encodeLevel(const std::vector<float>& level, std::uint32_t number, format::CubeMap& map) {
  const std::uint32_t edge = kEdge >> number, blocks = format::cubeBlocks(number);
  std::byte* out = map.blocks.data() + format::cubeLevelOffset(number);
  for (std::uint32_t b = 0; b < blocks * blocks * format::kCubeFaces; ++b, out += format::kBc4Bytes) {
    const std::uint32_t face = b / (blocks * blocks), row = b / blocks % blocks, column = b % blocks;
    std::array<std::uint8_t, 16> texels{};
    for (std::uint32_t i = 0; i < 16; ++i) {  // small levels repeat their last texel
      const std::uint32_t x = std::min(column * 4 + i % 4, edge - 1), y = std::min(row * 4 + i / 4, edge - 1);
      texels[i] = static_cast<std::uint8_t>(level[(std::size_t{face} * edge + y) * edge + x] * 255 + 0.5f);
    }
    const auto block = encodeBc4(texels);
    std::copy(block.begin(), block.end(), out);
  }
}

format::CubeMap encode(std::vector<float> level) {
  format::CubeMap map{};
  for (std::uint32_t number = 0; number < format::kCubeLevels; ++number) {
    encodeLevel(level, number, map);
    if (number + 1 < format::kCubeLevels) level = halved(level, kEdge >> number);
  }
  return map;
}

// The values of all maps together are stretched to [0, 1].
std::vector<MapValues> stretched(const std::vector<double>& values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double low = *least, span = *most > low ? *most - low : 1;
  std::vector<MapValues> maps(values.size() / kMapTexels, MapValues(kMapTexels));
  for (std::size_t i = 0; i < values.size(); ++i) {
    maps[i / kMapTexels][i % kMapTexels] = static_cast<float>((values[i] - low) / span);
  }
  return maps;
}

}  // namespace

MapValues pictureValues(const Image& picture) {
  std::vector<double> values(kMapTexels);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Vec3 d = unitDirection(i);
    const double across = std::sqrt(d[0] * d[0] + d[2] * d[2]);
    const double longitude = format::turnsOf(d[0], d[2]), latitude = format::turnsOf(d[1], across);
    values[i] = picture.sample(longitude + 0.5, 0.5 - 2 * latitude, true)[0];
  }
  return stretched(values).front();
}

std::vector<MapValues> noiseValues(const NoiseMap& map) {
  std::vector<double> values(kMapTexels * map.frames);
  parallelRanges(values.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      values[i] = animated(map, unitDirection(i % kMapTexels), static_cast<std::uint32_t>(i / kMapTexels));
    }
  });
  return stretched(values);
}

format::CubeMap makePictureMap(const Image& picture) {
  return encode(pictureValues(picture));
}

std::vector<format::CubeMap> makeNoiseMaps(const NoiseMap& map) {
  const std::vector<MapValues> values = noiseValues(map);
  std::vector<format::CubeMap> maps(values.size());
  parallelRanges(maps.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) maps[f] = encode(values[f]);
  });
  return maps;
}

}  // namespace billow::compiler
