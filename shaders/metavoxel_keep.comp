// Marks the slots that hold what this draw has cells for; a thread an occupied cell.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel.glsl"

layout(local_size_x = 256) in;

void main() {
  const MetavoxelCounters counters = Counters(meta.ramps.zw).value;
  const uint i = gl_GlobalInvocationID.x;
  if (i >= counters.check.x) return;
  const uint cell = Words(meta.items.xy).items[i];
  const uint kept = Words(meta.kept.xy).items[cell];
  if (kept == 0u) return;
  Slots slots = Slots(meta.kept.zw);
  if (slots.items[kept - 1u].owner.x == cell + 1u) slots.items[kept - 1u].owner.y = meta.picture.z;
}
