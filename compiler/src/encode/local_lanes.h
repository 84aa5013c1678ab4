// The loops of local bricks over their sixteen cells, with what SIMD the machine has and the same bits on every one.
#ifndef BILLOW_COMPILER_ENCODE_LOCAL_LANES_H
#define BILLOW_COMPILER_ENCODE_LOCAL_LANES_H

#include "encode/texel_range.h"

namespace billow::compiler {

constexpr std::uint32_t kCellVoxels = format::kBrickVoxels / format::kLocalCells;

// A brick cell by cell: cell c is lane c & 7 of group c >> 3, its voxel (x, y, z) number (x & 3) * 8 + (y & 3) * 2 +
// (z & 1).
struct Cells {
  alignas(32) float place[2][kCellVoxels][8];   // in [0, 1] of the brick's range
  alignas(32) float weight[2][kCellVoxels][8];  // 1 for an active voxel, else 0
  alignas(32) float low[2][8];                  // of the active places; above high where there is none
  alignas(32) float high[2][8];
  alignas(32) float count[2][8];  // active voxels
};
void fillCells(const BrickSource& brick, ValueRange range, Cells& cells);

// A place p is at offset + factor * p on the scale [0, 255] of the cells' ends; indices are in [first, last].
struct CellScale {
  float offset, factor;
  float first, last;
};
struct CellFit {
  alignas(32) float base[2][8];
  alignas(32) float top[2][8];
  alignas(32) float index[2][kCellVoxels][8];  // 0 for inactive voxels
};
void fitCells(const Cells& cells, const CellScale& scale, CellFit& fit);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_LOCAL_LANES_H
