// A cell in which something is: noted when the first thing is found there.
#ifndef BILLOW_METAVOXEL_TOUCH
#define BILLOW_METAVOXEL_TOUCH

#include "metavoxel.glsl"

// Whether the eye sees the cell, or something behind it on the light's way: then its shadow counts.
bool cellWanted(uvec3 cell) {
  if (!hasFlag(kFlagCull)) return true;
  vec3 low, high;
  grownCell(cell, low, high);
  for (uint i = 0u; i < kPlanes; ++i) {
    const vec4 plane = meta.planes[i];
    if (plane.z > 0.0) continue;  // light runs to the inner side
    const vec3 most = max(plane.xyz * low, plane.xyz * high);
    if (most.x + most.y + most.z + plane.w < 0.0) return false;
  }
  return true;
}

// `word` was the cell's word before this thing was noted in it.
void noteCell(uint cell, uint word) {
  if (word != 0u) return;
  const uint at = atomicAdd(Counters(meta.ramps.zw).value.wanted.x, 1u);
  if (at < meta.pool.w) Words(meta.items.xy).items[at] = cell;
}

#endif
