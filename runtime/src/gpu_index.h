// The three indices over a grid's cells, built from its regions (the 128^3 voxels of a Node4).
#ifndef BILLOW_RUNTIME_GPU_INDEX_H
#define BILLOW_RUNTIME_GPU_INDEX_H

#include <cstdint>
#include <vector>

#include "gpu_grid.h"

namespace billow::runtime {

struct RegionLeaf {
  std::uint32_t child;  // Node4 bit
  std::uint32_t record;
};

struct Region {
  std::uint32_t number;            // Node5 bit
  std::vector<RegionLeaf> leaves;  // ascending child
  std::uint32_t absent;            // record where there is no leaf; 0 is the background
};

// `regions` are all that the active box touches, by ascending number.
void buildFlat(GpuGrid& grid, const std::vector<Region>& regions);
void buildTree(GpuGrid& grid, const std::vector<Region>& regions);
void buildDense(GpuGrid& grid, const std::vector<Region>& regions);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_GPU_INDEX_H
