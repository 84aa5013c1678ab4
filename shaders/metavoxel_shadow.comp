// The shadow on the scene: optical depth of the whole space along each column of voxels, where anything is in it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_column.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 1, binding = 4, r32f) writeonly uniform image2D shadow;

bool lastOfItsColumn(uvec3 cell) {
  for (uint z = cell.z + 1u; z < Counters(meta.ramps.zw).value.boxMax.z; ++z) {
    if (positionOf(uvec3(cell.xy, z)) != kNone) return false;
  }
  return true;
}

void main() {
  const Column column = columnOf();
  if (!insideColumn(column.texel) || !lastOfItsColumn(column.cell)) return;
  const float own = Floats(meta.texels.zw).items[columnNumber(column.position, column.texel - 1u)];
  const uvec2 voxel = column.cell.xy * innerVoxels() + column.texel - 1u;
  imageStore(shadow, ivec2(voxel), vec4(depthAbove(column.cell, column.texel) + own));
}
