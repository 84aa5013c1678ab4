#include "effect/rasterise.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <vector>

#include "billow/format/particle_field.h"
#include "parallel.h"

namespace billow::compiler {
namespace {

constexpr std::int32_t kBrickEdge = 8;
constexpr std::size_t kMostBricks = std::size_t{1} << 17;  // 2 GB of seven grids
constexpr double kMostPairs = 1 << 26;                     // of a brick and a particle that may reach it
constexpr double kMostIndex = 1 << 30;

using Cell = std::array<std::int32_t, 3>;  // of 8^3 voxels
using Bins = std::map<Cell, std::vector<std::uint32_t>>;

[[noreturn]] void failTooSmall(double voxelSize) {
  throw Error(
      Fault::commandLine,
      fmt::format("--voxel-size {}: the effect would have more than {} bricks of 8x8x8 voxels; give a larger one",
                  voxelSize, kMostBricks));
}

// Which particles may reach which bricks, by their bounding spheres' boxes; particles in order.
Bins binParticles(std::span<const format::Particle> particles, double voxelSize) {
  Bins bins;
  double pairs = 0;
  const double brick = voxelSize * kBrickEdge;
  for (std::uint32_t p = 0; p < particles.size(); ++p) {
    if (!(particles[p].radius > 0)) continue;
    Cell low{}, high{};
    double cells = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      const double center = static_cast<double>(particles[p].center[i]),
                   radius = static_cast<double>(particles[p].radius);
      const double first = std::floor((center - radius) / brick), last = std::floor((center + radius) / brick);
      if (!(first > -kMostIndex / kBrickEdge && last < kMostIndex / kBrickEdge)) failTooSmall(voxelSize);
      cells *= last - first + 1;
      low[i] = static_cast<std::int32_t>(first);
      high[i] = static_cast<std::int32_t>(last);
    }
    pairs += cells;
    if (pairs > kMostPairs || cells > static_cast<double>(kMostBricks)) failTooSmall(voxelSize);
    for (std::int32_t x = low[0]; x <= high[0]; ++x) {
      for (std::int32_t y = low[1]; y <= high[1]; ++y) {
        for (std::int32_t z = low[2]; z <= high[2]; ++z) bins[{x, y, z}].push_back(p);
      }
    }
    if (bins.size() > kMostBricks) failTooSmall(voxelSize);
  }
  return bins;
}

constexpr std::size_t kGrids = 7;  // density, three of colour, three of emission
struct Brick {
  bool any = false;
  format::Mask3 active{};
  std::array<format::Values, kGrids> values{};
};

void addSample(const format::ParticleSample& sample, float extinction, std::uint32_t voxel, Brick& brick) {
  brick.any = true;
  brick.active.words[voxel >> 5] |= 1u << (voxel & 31);
  brick.values[0][voxel] += sample.density * extinction;
  for (std::size_t c = 0; c < 3; ++c) {
    brick.values[1 + c][voxel] = std::max(brick.values[1 + c][voxel], sample.diffuse[c]);
    brick.values[4 + c][voxel] += sample.emission[c];
  }
}

Brick fillBrick(const format::ParticleField& field, std::span<const format::Particle> particles, const Cell& cell,
                std::span<const std::uint32_t> inside, double voxelSize) {
  Brick brick;
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    const std::array<std::uint32_t, 3> at{v >> 6, v >> 3 & 7, v & 7};
    std::array<float, 3> point{};
    for (std::size_t i = 0; i < 3; ++i) {
      point[i] = static_cast<float>((cell[i] * kBrickEdge + static_cast<std::int32_t>(at[i])) * voxelSize);
    }
    for (const std::uint32_t p : inside) {
      const format::ParticleSample sample = field.sample(particles[p], point);
      if (sample.density > 0) addSample(sample, particles[p].extinction, v, brick);
    }
  }
  return brick;
}

ImportedGrid gridOf(const std::vector<Cell>& cells, const std::vector<Brick>& bricks, std::size_t which,
                    double voxelSize) {
  ImportedGrid grid;
  grid.present = true;
  for (std::size_t i = 0; i < 3; ++i) grid.indexToWorld[5 * i] = voxelSize;
  for (std::size_t b = 0; b < bricks.size(); ++b) {
    if (!bricks[b].any) continue;
    Leaf leaf{{cells[b][0] * kBrickEdge, cells[b][1] * kBrickEdge, cells[b][2] * kBrickEdge},
              bricks[b].active,
              bricks[b].values[which]};
    for (const std::uint32_t word : leaf.active.words) {
      grid.activeVoxels += static_cast<std::uint64_t>(std::popcount(word));
    }
    const auto [least, most] = std::minmax_element(leaf.values.begin(), leaf.values.end());
    grid.min = std::min(grid.min, *least);
    grid.max = std::max(grid.max, *most);
    grid.leaves.push_back(leaf);
  }
  return grid;
}

}  // namespace

RasterisedEffect rasterise(const format::EffectTables& tables, std::span<const format::Particle> particles,
                           double voxelSize) {
  const Bins bins = binParticles(particles, voxelSize);
  std::vector<Cell> cells;
  std::vector<std::span<const std::uint32_t>> inside;
  for (const auto& [cell, list] : bins) {
    cells.push_back(cell);
    inside.emplace_back(list);
  }
  const format::ParticleField field(tables);
  std::vector<Brick> bricks(cells.size());
  parallelRanges(cells.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) bricks[b] = fillBrick(field, particles, cells[b], inside[b], voxelSize);
  });
  RasterisedEffect result;
  result.density = gridOf(cells, bricks, 0, voxelSize);
  for (std::size_t c = 0; c < 3; ++c) {
    result.colour[c] = gridOf(cells, bricks, 1 + c, voxelSize);
    result.emission[c] = gridOf(cells, bricks, 4 + c, voxelSize);
  }
  return result;
}

}  // namespace billow::compiler
