// Where what is now in a voxel of the space was in the layer's frame: a step back along its velocity grids (Stam 1999,
// "Stable Fluids"), with the velocity that is met half way.
#ifndef BILLOW_METAVOXEL_CARRY
#define BILLOW_METAVOXEL_CARRY

#include "metavoxel_volume.glsl"

vec3 indexAlong(uint g, vec3 way) {
  return vec3(dot(params.grids[g].toIndex[0].xyz, way), dot(params.grids[g].toIndex[1].xyz, way),
              dot(params.grids[g].toIndex[2].xyz, way));
}
float readGrid(uint g, vec3 world) { return sampleGrid(g, indexOf(g, world), kFilterTrilinear); }

// By how many voxels matter is carried at the velocity of a place.
vec3 wayAt(vec3 voxel) {
  const vec3 far = farthest();
  const vec3 velocity = velocityAt(worldOf(voxel), mat3(meta.toWorld[0].xyz * far.x, meta.toWorld[1].xyz * far.y,
                                                        meta.toWorld[2].xyz * far.z));
  const vec3 way = vec3(dot(params.flow[0].xyz, velocity), dot(params.flow[1].xyz, velocity),
                        dot(params.flow[2].xyz, velocity));
  return clamp(way, -far, far);
}

const float kCarriedUnits = 16.0;  // a voxel, of the box
shared ivec3 carriedLow;
shared ivec3 carriedHigh;

// Takes both places of each thread back, and gives a box that holds the voxels around all of the group's.
void carryBack(inout vec3 voxels[2], out vec3 from, out vec3 to) {
  for (uint i = 0u; i < 2u; ++i) voxels[i] -= wayAt(voxels[i] - 0.5 * wayAt(voxels[i]));
  if (gl_LocalInvocationIndex == 0u) {
    carriedLow = ivec3(0x7fffffff);
    carriedHigh = ivec3(-0x7fffffff);
  }
  barrier();
  const ivec3 low = ivec3(floor((min(voxels[0], voxels[1]) - 0.5) * kCarriedUnits));
  const ivec3 high = ivec3(ceil((max(voxels[0], voxels[1]) + 0.5) * kCarriedUnits));
  for (uint axis = 0u; axis < 3u; ++axis) {
    atomicMin(carriedLow[axis], low[axis]);
    atomicMax(carriedHigh[axis], high[axis]);
  }
  barrier();
  from = vec3(carriedLow) / kCarriedUnits;
  to = vec3(carriedHigh) / kCarriedUnits;
}

#endif
