// What a grid frame costs on the GPU: the one policy for the runtime's index and for every size that we quote.
#ifndef BILLOW_FORMAT_GPU_SIZE_H
#define BILLOW_FORMAT_GPU_SIZE_H

#include <array>
#include <cstdint>
#include <span>

#include "billow/format/effect.h"
#include "billow/format/layout.h"

namespace billow::format {

enum class GpuIndex : std::uint32_t {
  flat = 0,  // u32 Node3 slot + 1 for each 8^3 cell of the active box
  tree = 1,  // Node5 and Node4s with a rank per mask word, and child lists
};

// What the GPU reads of a Node3, or of an active tile: its brick, mask, lo and scale.
inline constexpr std::uint64_t kGpuRecordBytes = 16;

struct GpuBytes {
  GpuIndex index = GpuIndex::flat;
  std::uint64_t indexBytes = 0;
  std::uint64_t recordBytes = 0;  // one record a Node3, and one a distinct value of active tiles
  std::uint64_t maskBytes = 0;
  std::uint64_t brickBytes = 0;
  std::uint64_t classBytes[kBrickClassCount] = {};  // of brickBytes, by class
  std::uint64_t total() const;
};

// Brick cells of the active box, per axis (0 where nothing is active).
struct CellBox {
  std::uint32_t min[3];  // in bricks, pack index space
  std::uint32_t dim[3];
  std::uint64_t count() const { return std::uint64_t{dim[0]} * dim[1] * dim[2]; }
};
CellBox cellBox(const GridFrame& gridFrame);

GpuBytes gpuBytes(const GridFrame& gridFrame);

// Of all grid frames together where all are resident: what they share is counted once. `stored`: items of each stream
// in the pack (the page table's last range ends).
std::uint64_t packGpuBytes(std::span<const GridFrame> gridFrames,
                           const std::array<std::uint64_t, kStreamCount>& stored);

// A displacement map: a byte a texel of its largest level, each face with a border of one.
inline constexpr std::uint64_t kGpuCubeBytes = std::uint64_t{kCubeFaces} * (kCubeEdge + 2) * (kCubeEdge + 2);

// Of effects, all of a pack drawn at once.
struct EffectGpuBytes {
  std::uint64_t materials = 0, curves = 0, ramps = 0, maps = 0, surfaces = 0, emitters = 0, given = 0;
  std::uint64_t tracks = 0;     // points of all frames, with radii where any has them
  std::uint64_t particles = 0;  // as many as may be alive
  std::uint64_t total() const;
};
EffectGpuBytes effectGpuBytes(const EffectTables& tables);

// Adds a distinct brick of a known encoding to the grid frame's counts; a constant adds nothing.
void countBrick(GridFrame& gridFrame, std::uint32_t encoding);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_GPU_SIZE_H
