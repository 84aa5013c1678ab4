// Gives every occupied cell its position and its list a place; a thread a cell.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_order.glsl"

layout(local_size_x = 256) in;

shared uvec2 tile[256];

bool precedes(uvec2 a, uvec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

// How many cells come before mine: all are compared, for only when the pool is too small is there an order at all.
uint rankOf(uvec2 mine, uint items) {
  uint rank = 0u;
  for (uint first = 0u; first < items; first += 256u) {
    const uint i = first + gl_LocalInvocationID.x;
    barrier();
    if (i < items) {
      const uint cell = Words(meta.items.xy).items[i];
      tile[gl_LocalInvocationID.x] = uvec2(orderKey(cellOf(cell)), cell);
    }
    barrier();
    const uint count = min(items - first, 256u);
    for (uint j = 0u; j < count; ++j) rank += precedes(tile[j], mine) ? 1u : 0u;
  }
  return rank;
}

// The slot that the cell has kept, or one of those that nobody draws.
uint slotFor(uint cell) {
  Slots slots = Slots(meta.kept.zw);
  const uint kept = Words(meta.kept.xy).items[cell];
  if (kept != 0u && slots.items[kept - 1u].owner.x == cell + 1u) return kept - 1u;
  Counters counters = Counters(meta.ramps.zw);
  const uint number = atomicAdd(counters.value.spare.z, 1u);
  const uint empty = counters.value.spare.x;
  const uint last = min(meta.pool.z, meta.pool.w) - 1u;
  const uint slot = Words(meta.spare.xy).items[number < empty ? number : last - (number - empty)];
  slots.items[slot].owner = uvec4(cell + 1u, meta.picture.z, 0u, 0u);
  Words(meta.kept.xy).items[cell] = slot + 1u;
  return slot;
}

void main() {
  Counters counters = Counters(meta.ramps.zw);
  const uint items = counters.value.wanted.z;
  const uint i = gl_GlobalInvocationID.x;
  const uint cell = Words(meta.items.xy).items[min(i, items - 1u)];
  const uvec3 at = cellOf(cell);
  uint position = i;
  if (items > meta.pool.z) position = rankOf(uvec2(orderKey(at), cell), items);
  if (i >= items) return;
  if (counters.value.check.x != 0u) position = slotFor(cell);
  Words(meta.cells.zw).items[cell] = position + 1u;
  Words(meta.items.zw).items[position] = cell;
  const uint count = wordOf(cell) & ((1u << kVolumeBit) - 1u);
  const uint first = atomicAdd(counters.value.wanted.y, count);
  const uint room = meta.limits.y - min(first, meta.limits.y);
  Pairs(meta.lists.xy).items[position] = uvec2(first, min(count, room));
  Words(meta.lists.zw).items[position] = 0u;
  for (uint axis = 0u; axis < 3u; ++axis) {
    atomicMax(counters.value.boxMin[axis], ~at[axis]);
    atomicMax(counters.value.boxMax[axis], at[axis] + 1u);
  }
}
