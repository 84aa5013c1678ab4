// Whether a layer of a volume has anything in a box of voxels of the space; all threads of a workgroup look.
#ifndef BILLOW_METAVOXEL_VOLUME
#define BILLOW_METAVOXEL_VOLUME

#include "metavoxel.glsl"
#include "velocity.glsl"

shared uint found;

// By how many voxels of the space matter is carried at most.
vec3 farthest() { return carries() ? vec3(params.flow[0].w, params.flow[1].w, params.flow[2].w) : vec3(0.0); }

// Pack index box of what a filtered read between `a` and `b` may touch. Its corners bound it, for the map is affine.
void indexBox(uint g, vec3 a, vec3 b, out vec3 low, out vec3 high) {
  low = vec3(3e38);
  high = vec3(-3e38);
  for (uint corner = 0u; corner < 8u; ++corner) {
    const vec3 world = worldOf(mix(a, b, notEqual(corner & uvec3(1, 2, 4), uvec3(0u))));
    const vec3 p = indexOf(g, world);
    low = min(low, p);
    high = max(high, p);
  }
}

bool anythingIn(uint g, vec3 from, vec3 to) {
  vec3 low, high;
  indexBox(g, from, to, low, high);
  const vec3 a = max(low, params.grids[g].boxMin.xyz);
  const vec3 b = min(high, params.grids[g].boxMax.xyz);
  if (any(greaterThan(a, b))) return false;
  if (params.grids[g].boxMax.w == 0.0) return true;  // its background is something
  const ivec3 first = ivec3(floor(a)) >> 3;
  const uvec3 count = uvec3((ivec3(floor(b)) + 1 >> 3) - first + 1);
  const uint threads = gl_WorkGroupSize.x * gl_WorkGroupSize.y * gl_WorkGroupSize.z;
  for (uint i = gl_LocalInvocationIndex; i < count.x * count.y * count.z && found == 0u; i += threads) {
    if (findRecord(g, first + ivec3(i % count.x, i / count.x % count.y, i / (count.x * count.y))) != 0u) return true;
  }
  return false;
}

// The same answer for all threads.
bool volumeHas(vec3 from, vec3 to) {
  if (gl_LocalInvocationIndex == 0u) found = 0u;
  barrier();
  for (uint g = 0u; g < kMatterSlots; ++g) {
    if (hasGrid(g) && found == 0u && anythingIn(g, from, to)) atomicOr(found, 1u);
  }
  barrier();
  return found != 0u;
}

#endif
