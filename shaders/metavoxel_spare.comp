// Lists the slots that nobody draws, those without an owner from the front and the others from the back; a thread a
// slot. Where the pool is used in rounds, all slots lose their owners.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel.glsl"

layout(local_size_x = 256) in;

void main() {
  const uint slot = gl_GlobalInvocationID.x;
  const uint count = min(meta.pool.z, meta.pool.w);
  if (slot >= count) return;
  Counters counters = Counters(meta.ramps.zw);
  Slots slots = Slots(meta.kept.zw);
  const uvec4 owner = slots.items[slot].owner;
  if (counters.value.check.x == 0u) {
    if (counters.value.wanted.z != 0u) slots.items[slot].owner = uvec4(0u);
  } else if (owner.x == 0u) {
    Words(meta.spare.xy).items[atomicAdd(counters.value.spare.x, 1u)] = slot;
  } else if (owner.y != meta.picture.z) {
    Words(meta.spare.xy).items[count - 1u - atomicAdd(counters.value.spare.y, 1u)] = slot;
  }
}
