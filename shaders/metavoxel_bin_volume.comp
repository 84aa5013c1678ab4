// A volume into cells, a workgroup a cell of the volume's box: whether any brick or tile lies in it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "lookup.glsl"
#include "metavoxel_touch.glsl"

layout(local_size_x = 64) in;

shared uint found;

// Pack index box of what the cell's texels may read of grid g. Its corners bound it, for the map is affine.
void indexBox(uint g, uvec3 cell, out vec3 low, out vec3 high) {
  vec3 a, b;
  grownCell(cell, a, b);
  low = vec3(3e38);
  high = vec3(-3e38);
  for (uint corner = 0u; corner < 8u; ++corner) {
    const vec3 world = worldOf(mix(a, b, notEqual(corner & uvec3(1, 2, 4), uvec3(0u))));
    const vec3 p = vec3(dot(params.grids[g].toIndex[0].xyz, world), dot(params.grids[g].toIndex[1].xyz, world),
                        dot(params.grids[g].toIndex[2].xyz, world)) +
                   vec3(params.grids[g].toIndex[0].w, params.grids[g].toIndex[1].w, params.grids[g].toIndex[2].w);
    low = min(low, p);
    high = max(high, p);
  }
}

bool anythingIn(uint g, uvec3 cell) {
  vec3 low, high;
  indexBox(g, cell, low, high);
  const vec3 a = max(low, params.grids[g].boxMin.xyz);
  const vec3 b = min(high, params.grids[g].boxMax.xyz);
  if (any(greaterThan(a, b))) return false;
  if (params.grids[g].boxMax.w == 0.0) return true;  // its background is something
  const ivec3 first = ivec3(floor(a)) >> 3;
  const uvec3 count = uvec3((ivec3(floor(b)) + 1 >> 3) - first + 1);
  for (uint i = gl_LocalInvocationID.x; i < count.x * count.y * count.z && found == 0u; i += 64u) {
    if (findRecord(g, first + ivec3(i % count.x, i / count.x % count.y, i / (count.x * count.y))) != 0u) return true;
  }
  return false;
}

void main() {
  const uvec3 cell = gl_WorkGroupID + pass.box.xyz;
  if (!cellWanted(cell)) return;
  if (gl_LocalInvocationID.x == 0u) found = 0u;
  barrier();
  for (uint g = 0u; g < kGridSlots; ++g) {
    if (hasGrid(g) && found == 0u && anythingIn(g, cell)) atomicOr(found, 1u);
  }
  barrier();
  if (gl_LocalInvocationID.x != 0u || found == 0u) return;
  const uint number = cellNumber(cell);
  noteCell(number, atomicOr(Words(meta.cells.xy).items[number], 1u << (kVolumeBit + pass.volume)));
}
