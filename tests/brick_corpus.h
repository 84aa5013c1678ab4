// Bricks to test and time the encoders on, made with exactly rounded operations only, so that every build has the same.
#ifndef BILLOW_TESTS_BRICK_CORPUS_H
#define BILLOW_TESTS_BRICK_CORPUS_H

#include <bit>
#include <cstdint>
#include <functional>
#include <vector>

#include "billow/format/brick.h"

namespace billow::tests {

struct Brick {
  format::Values values{};
  format::Mask3 active{};
  std::uint32_t activeCount = 0;

  void activate(std::uint32_t index) { active.words[index >> 5] |= 1u << (index & 31); }
  void count() {
    activeCount = 0;
    for (const std::uint32_t word : active.words) activeCount += static_cast<std::uint32_t>(std::popcount(word));
  }
};

// A brick of `value(x, y, z)` where `active(index)`.
inline Brick makeBrick(
    const std::function<float(std::uint32_t, std::uint32_t, std::uint32_t)>& value,
    const std::function<bool(std::uint32_t)>& active = [](std::uint32_t) { return true; }) {
  Brick brick;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    brick.values[i] = value(i >> 6, i >> 3 & 7, i & 7);
    if (active(i)) brick.activate(i);
  }
  brick.count();
  return brick;
}

inline std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  std::uint32_t h = x * 0x8da6b343u ^ y * 0xd8163841u ^ z * 0xcb1ab31fu;
  h = (h ^ h >> 15) * 0x2c1b3c6du;
  h = (h ^ h >> 12) * 0x297a2d39u;
  return h ^ h >> 15;
}

// In [0, 1].
inline float randomValue(std::uint32_t seed, std::uint32_t index) {
  return static_cast<float>(hash(seed, index, 12345) >> 8) / 16777215.0f;
}

// Value noise in [0, 1], smooth between lattice points; coordinates at least 0.
inline double noise(double x, double y, double z) {
  const auto ix = static_cast<std::uint32_t>(x), iy = static_cast<std::uint32_t>(y), iz = static_cast<std::uint32_t>(z);
  const auto fade = [](double t) { return t * t * (3 - 2 * t); };
  const double fx = fade(x - ix), fy = fade(y - iy), fz = fade(z - iz);
  double total = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    const double weight = (dx != 0 ? fx : 1 - fx) * (dy != 0 ? fy : 1 - fy) * (dz != 0 ? fz : 1 - fz);
    total += weight * (hash(ix + dx, iy + dy, iz + dz) / 4294967295.0);
  }
  return total;
}

// Density at voxel (x, y, z) of a ball of `dim` voxels across, falling off from the middle and eroded by five octaves.
inline float cloudDensity(std::uint32_t dim, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const double half = dim / 2.0;
  const double dx = x / half - 1, dy = y / half - 1, dz = z / half - 1;
  double fbm = 0;
  double scale = 4.0 / dim, amplitude = 0.5;
  for (int octave = 0; octave < 5; ++octave, scale *= 2, amplitude *= 0.45) {
    fbm += amplitude * noise(x * scale + 7, y * scale + 7, z * scale + 7);
  }
  const double density = fbm * 1.4 - (dx * dx + dy * dy + dz * dz) * 0.7;
  return density > 0 ? static_cast<float>(density) : 0.0f;
}

// The bricks of that cloud which hold an active voxel (density over 0). `dim` is a multiple of 8.
inline std::vector<Brick> cloudBricks(std::uint32_t dim) {
  std::vector<Brick> bricks;
  for (std::uint32_t x0 = 0; x0 < dim; x0 += 8) {
    for (std::uint32_t y0 = 0; y0 < dim; y0 += 8) {
      for (std::uint32_t z0 = 0; z0 < dim; z0 += 8) {
        Brick brick;
        for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
          brick.values[i] = cloudDensity(dim, x0 + (i >> 6), y0 + (i >> 3 & 7), z0 + (i & 7));
          if (brick.values[i] > 0) brick.activate(i);
        }
        brick.count();
        if (brick.activeCount != 0) bricks.push_back(brick);
      }
    }
  }
  return bricks;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_BRICK_CORPUS_H
