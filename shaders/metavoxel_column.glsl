// Columns of texels along the light: what a thread of the light's passes has, and where its light came from.
#ifndef BILLOW_METAVOXEL_COLUMN
#define BILLOW_METAVOXEL_COLUMN

#include "metavoxel_pool.glsl"

struct Column {
  uint slot;
  uint position;
  uvec3 cell;
  uvec2 block;  // of texels, the workgroup's
  uvec2 texel;
};

Column columnOf() {
  Column column;
  const uvec4 range = Rounds(meta.rounds.xy).items[pass.round].range;
  column.slot = drawnSlot(range, gl_WorkGroupID.z);
  column.position = range.x + column.slot;
  column.cell = cellOf(cellAt(column.position));
  column.block = gl_WorkGroupID.xy;
  column.texel = column.block * kSubBlock + gl_LocalInvocationID.xy;
  return column;
}

// The texels of block z of a column, from the first to past the last.
uvec2 texelsOf(uint z) { return uvec2(z * kSubBlock, min((z + 1u) * kSubBlock, edgeTexels())); }

bool insideColumn(uvec2 texel) {
  return all(greaterThanEqual(texel, uvec2(1u))) && all(lessThanEqual(texel, uvec2(innerVoxels())));
}

// Of the inner column `voxel` (texel - 1) of the metavoxel at a position.
uint columnNumber(uint position, uvec2 voxel) {
  return (position * innerVoxels() + voxel.y) * innerVoxels() + voxel.x;
}

// Optical depth between the light and a cell's layer, along the column of voxels that a texel lies in. A border's column
// is an inner one of the next cell, and has its light.
float depthAbove(uvec3 cell, uvec2 texel) {
  const uint inner = innerVoxels();
  const uvec2 beyond = uvec2(greaterThan(texel, uvec2(inner)));
  const uvec2 before = uvec2(equal(texel, uvec2(0u)));
  const uvec2 owner = cell.xy + beyond - before;  // at the space's lower edge far beyond the upper
  if (any(greaterThanEqual(owner, uvec2(cellsAxis())))) return 0.0;
  const uvec2 at = texel - 1u + before * inner - beyond * inner;
  float depth = 0.0;
  for (uint z = ~Counters(meta.ramps.zw).value.boxMin.z; z < cell.z; ++z) {
    const uint position = positionOf(uvec3(owner, z));
    if (position != kNone) depth += Floats(meta.texels.zw).items[columnNumber(position, at)];
  }
  return depth;
}

#endif
