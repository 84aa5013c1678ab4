// The order in which metavoxels are drawn when not all fit into the pool: light's layers first to last; of a layer, cells
// by their distance from the eye along x, then y. Up to the eye's layer from far to near, each in front of those before
// it; in later layers from near to far, each behind them.
#ifndef BILLOW_METAVOXEL_ORDER
#define BILLOW_METAVOXEL_ORDER

#include "metavoxel.glsl"

ivec3 eyeCell() {
  const vec3 cell = floor(voxelOf(meta.eye.xyz) / float(innerVoxels()));
  return ivec3(clamp(cell, vec3(-1.0), vec3(cellsAxis())));
}

bool beforeEye(uvec3 cell) { return int(cell.z) <= eyeCell().z; }

uint orderKey(uvec3 cell) {
  const uvec2 apart = uvec2(abs(ivec2(cell.xy) - eyeCell().xy));
  const uvec2 along = beforeEye(cell) ? 255u - apart : apart;
  return cell.z << 16 | along.x << 8 | along.y;
}

#endif
