// Forgets the cells of the frame before: those alone, or all where it had more than it could note.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel.glsl"

layout(local_size_x = 256) in;

void main() {
  const MetavoxelCounters counters = Counters(meta.ramps.zw).value;
  const uint i = gl_GlobalInvocationID.x;
  const bool all = counters.reset.w != 0u;
  if (i >= (all ? 1u << 3u * cellBits() : counters.wanted.x)) return;
  const uint cell = all ? i : Words(meta.items.xy).items[i];
  Words(meta.cells.xy).items[cell] = 0u;
  Words(meta.cells.zw).items[cell] = 0u;
}
