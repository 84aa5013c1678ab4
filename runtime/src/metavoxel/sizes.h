// How large everything of a Metavoxels is: all of it is known when it is made.
#ifndef BILLOW_RUNTIME_METAVOXEL_SIZES_H
#define BILLOW_RUNTIME_METAVOXEL_SIZES_H

#include <bit>

#include "api.h"
#include "billow/runtime/metavoxel.h"
#include "metavoxel_interface.h"

namespace billow::runtime {

inline constexpr std::uint32_t kMostRounds = 256;
// Along an axis of the light field: its pyramid's image fits into the 256^3 that every device has.
inline constexpr std::uint32_t kMostFieldVoxels = 160;

// 8 of the pool's image, 4 of emission, and 4 of albedo where metavoxels stay filled.
inline std::uint64_t texelBytes(const MetavoxelConfig& config) {
  return config.keepFilled ? 16 : 12;
}

// Where the arrays of metavoxel_interface.h begin in the device's buffer.
struct MetavoxelRegions {
  std::uint64_t counters, rounds, words, positions, found, cellAt, lists, cursors, kept, slots, spare, fills, entries,
      particles, jobs, materials, curves, ramps, emitters, points, radii, given, surfaces, columns, fieldMatter, blocks,
      volumeWork, fillWork, emission, albedo;
  std::uint64_t bytes;
};

// The light field, and the pyramid of what shines into it: all levels in one image, each with a border of one texel.
struct FieldSizes {
  std::uint32_t edge, perCell;  // voxels along an axis of the space, 0: there is none; along an axis of a cell
  std::uint32_t levels;
  std::array<std::array<std::uint32_t, 4>, gpu::kFieldLevels> level;  // first texel, edge
  std::array<std::uint32_t, 3> image;                                 // texels of the pyramid
};

struct MetavoxelSizes {
  std::uint32_t edge, inner, axis;  // texels, voxels, cells
  std::uint32_t slotsX, slotsY, slotsZ;
  std::uint32_t most;  // occupied cells
  std::uint32_t rounds;
  std::uint32_t cubeLayers;  // of the image of cube maps, at least 1
  FieldSizes field;
  MetavoxelRegions regions;

  std::uint32_t slots() const { return slotsX * slotsY * slotsZ; }
  std::uint64_t blocks() const {  // of all slots
    const std::uint64_t along = (edge + gpu::kSubBlock - 1) / gpu::kSubBlock;
    return slots() * along * along * along;
  }
  std::uint32_t cellBits() const { return static_cast<std::uint32_t>(std::bit_width(axis - 1)); }  // an axis
  // In the tables of cells, whose numbers are made of whole bits.
  std::uint64_t cells() const { return std::uint64_t{1} << 3 * cellBits(); }
  std::uint32_t shadowEdge() const { return axis * inner; }
};

// The first field outside of its range, or null.
const char* badConfig(const MetavoxelConfig& config);

// With a pool of at most so many slots. `slots` is at least 1.
MetavoxelSizes metavoxelSizes(const MetavoxelConfig& config, std::uint64_t slots, std::uint32_t maxImageExtent3D);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_METAVOXEL_SIZES_H
