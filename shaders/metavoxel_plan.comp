// One workgroup: how many metavoxels there are, and which rounds draw them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_order.glsl"

layout(local_size_x = 256) in;

shared uint before;

// `kept` slots, or 0 where none are.
void planRounds(uint items, uint kept) {
  Rounds rounds = Rounds(meta.rounds.xy);
  const uint blocks = blocksAxis();
  uint next = 0u;
  for (uint i = 0u; i < meta.limits.w; ++i) {
    const bool front = next < before;
    const uint count = min((front ? before : items) - next, meta.pool.z);
    const uint some = count == 0u ? 0u : 1u;
    const uint march = i == 0u ? 1u : some;  // the first begins the picture
    rounds.items[i].range = uvec4(next, count, front ? 1u : 0u, 0u);
    rounds.items[i].blocks = uvec4(count, some, some, 0u);
    rounds.items[i].volumes = uvec4(kWorkGroups, 0u, 1u, 0u);  // these two grow with the work that is found
    rounds.items[i].fill = uvec4(kWorkGroups, 0u, 1u, 0u);
    rounds.items[i].columns = uvec4(blocks, blocks, count, 0u);
    rounds.items[i].march = uvec4(meta.picture.xy * march, march, 0u);
    next += count;
  }
  if (kept == 0u) return;
  rounds.items[0].range = uvec4(0u, kept, 0u, 1u);
  rounds.items[0].blocks = uvec4(0u, 1u, 1u, 0u);  // grows with those that are to be filled
}

void main() {
  Counters counters = Counters(meta.ramps.zw);
  const uint wanted = counters.value.wanted.x;
  const uint items = min(wanted, meta.pool.w);
  if (gl_LocalInvocationID.x == 0u) before = 0u;
  barrier();
  const bool whole = items <= meta.pool.z;
  uint mine = 0u;
  for (uint i = gl_LocalInvocationID.x; i < items && !whole; i += 256u) {
    if (beforeEye(cellOf(Words(meta.items.xy).items[i]))) ++mine;
  }
  atomicAdd(before, mine);
  barrier();
  if (gl_LocalInvocationID.x != 0u) return;
  const bool all = wanted > meta.pool.w;
  const uint cells = 1u << 3u * cellBits();
  counters.value.reset = uvec4(((all ? cells : items) + 255u) / 256u, 1u, 1u, all ? 1u : 0u);
  counters.value.rank = uvec4((items + 255u) / 256u, 1u, 1u, before);
  const bool keep = hasFlag(kFlagKeep) && whole && items != 0u;
  counters.value.check = uvec4(keep ? items : 0u, 1u, 1u, 0u);
  counters.value.wanted.z = items;
  // Planned again for the light field, what all fits is filled already; `round` says so.
  const bool filled = pass.round != 0u && whole;
  if (!filled) counters.value.wanted.w = keep ? 0u : items;
  counters.value.boxMax.w = meta.picture.z;
  planRounds(items, keep ? min(meta.pool.z, meta.pool.w) : 0u);
  if (filled) Rounds(meta.rounds.xy).items[0].blocks.x = 0u;
}
