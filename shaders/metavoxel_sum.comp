// Optical depth of each inner column of the round's metavoxels, for the light of those below them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_column.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
  const Column column = columnOf();
  if (!insideColumn(column.texel)) return;
  const ivec3 first = ivec3(slotCorner(column.slot) + uvec3(column.texel, 0u));
  float depth = 0.0;
  for (uint block = 0u; block < blocksAxis(); ++block) {
    if ((blockHolds(column.slot, uvec3(column.block, block)) & kBlockMatter) == 0u) continue;
    const uvec2 range = clamp(texelsOf(block), 1u, innerVoxels() + 1u);
    for (uint z = range.x; z < range.y; ++z) depth += lightDepth(imageLoad(pool, first + ivec3(0, 0, z)).a);
  }
  Floats(meta.texels.zw).items[columnNumber(column.position, column.texel - 1u)] = depth;
}
