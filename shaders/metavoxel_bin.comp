// Particles into cells, a workgroup a particle: first they are counted, then written into the cells' lists.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_particles.glsl"
#include "metavoxel_touch.glsl"

layout(local_size_x = 32) in;
layout(constant_id = 4) const bool kWrite = false;

void count(uvec3 cell) {
  if (!cellWanted(cell)) return;
  const uint number = cellNumber(cell);
  noteCell(number, atomicAdd(Words(meta.cells.xy).items[number], 1u));
}

void write(uvec3 cell, uint particle) {
  const uint position = positionOf(cell);
  if (position == kNone) return;
  const uvec2 list = Pairs(meta.lists.xy).items[position];
  const uint at = atomicAdd(Words(meta.lists.zw).items[position], 1u);
  if (at < list.y) Words(meta.entries.xy).items[list.x + at] = particle;
}

void main() {
  const uint number = gl_WorkGroupID.y * kBinRow + gl_WorkGroupID.x;
  if (number >= meta.limits.x) return;
  const Particle particle = Particles(meta.entries.zw).items[number];
  if (!(particle.radius > 0.0)) return;
  const vec3 center = voxelOf(particle.center);
  const float radius = particle.radius / meta.eye.w;
  const float inner = float(innerVoxels());
  const vec3 last = vec3(cellsAxis() - 1u);
  const vec3 low = floor((center - radius - 0.5) / inner);
  const vec3 high = floor((center + radius + 0.5) / inner);
  if (any(lessThan(high, vec3(0.0))) || any(greaterThan(low, last))) return;
  const uvec3 from = uvec3(max(low, 0.0));
  const uvec3 count3 = uvec3(min(high, last)) - from + 1u;
  for (uint i = gl_LocalInvocationID.x; i < count3.x * count3.y * count3.z; i += 32u) {
    const uvec3 cell = from + uvec3(i % count3.x, i / count3.x % count3.y, i / (count3.x * count3.y));
    vec3 cellLow, cellHigh;
    grownCell(cell, cellLow, cellHigh);
    if (!meets(center, radius, cellLow, cellHigh)) continue;
    if (kWrite) {
      write(cell, number);
    } else {
      count(cell);
    }
  }
}
