// The shadow on the scene: optical depth along each column of voxels up to the scene, where anything is in it. Each
// round adds what its metavoxels have.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "metavoxel_caster.glsl"
#include "metavoxel_column.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 1, binding = 4, r32f) uniform image2D shadow;

// Slot of a cell's metavoxel, of no meaning where the round does not have it.
uint slotIn(uvec4 range, uvec3 cell) { return positionOf(cell) - range.x; }

bool firstOfItsColumn(uvec4 range, uvec3 cell) {
  for (uint z = ~Counters(meta.ramps.zw).value.boxMin.z; z < cell.z; ++z) {
    if (slotIn(range, uvec3(cell.xy, z)) < range.y) return false;
  }
  return true;
}

// Of a metavoxel's column of texels, up to the scene.
float depthBefore(uvec4 range, uint slot, uvec3 cell, Column column) {
  const float top = float(cell.z * innerVoxels());
  if (top >= casterSpan.y) return 0.0;
  if (top + float(innerVoxels()) <= casterSpan.x) {
    return Floats(meta.texels.zw).items[columnNumber(range.x + slot, column.texel - 1u)];
  }
  const ivec3 first = ivec3(slotCorner(slot) + uvec3(column.texel, 0u));
  float depth = 0.0;
  for (uint z = 1u; z <= innerVoxels(); ++z) {
    if ((blockHolds(slot, uvec3(column.block, z / kSubBlock)) & kBlockMatter) == 0u) continue;
    depth += sunnyShare(top + float(z) - 0.5) * lightDepth(imageLoad(pool, first + ivec3(0, 0, z)).a);
  }
  return depth;
}

void main() {
  const Column column = columnOf();
  const uvec4 range = Rounds(meta.rounds.xy).items[pass.round].range;
  if (!insideColumn(column.texel) || !firstOfItsColumn(range, column.cell)) return;
  const uvec2 voxel = column.cell.xy * innerVoxels() + column.texel - 1u;
  findCasters(vec2(voxel) + 0.5);
  float depth = imageLoad(shadow, ivec2(voxel)).r;
  for (uint z = column.cell.z; z < Counters(meta.ramps.zw).value.boxMax.z; ++z) {
    const uvec3 cell = uvec3(column.cell.xy, z);
    const uint slot = slotIn(range, cell);
    if (slot < range.y) depth += depthBefore(range, slot, cell, column);
  }
  imageStore(shadow, ivec2(voxel), vec4(depth));
}
