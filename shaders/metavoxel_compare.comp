// Which metavoxels must be filled: those that hold something else than what would fill them; a workgroup an occupied cell.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "billow/format/noise.h"
#include "metavoxel.glsl"

layout(local_size_x = 64) in;

shared uint low, high;  // sums over particles and volumes, whose order in a list nobody chooses

void addHash(uvec2 hash) {
  atomicAdd(low, hash.x);
  atomicAdd(high, hash.y);
}

uvec2 hashOf(uint particle) {
  uvec2 hash = uvec2(0x2545f491u, 0x9e3779b9u);
  for (uint i = 0u; i < kParticleWords; ++i) {
    const uint word = Words(meta.entries.zw).items[particle * kParticleWords + i];
    hash = uvec2(hashInteger(hash.x ^ word), hashInteger(hash.y + word * 0x9e3779b1u));
  }
  return hash;
}

// Has the slot filled where it must be; notes with what.
void claim(uint slot) {
  Slots slots = Slots(meta.kept.zw);
  const bool there = slots.items[slot].owner.z == meta.matter.z;
  if (there && hasFlag(kFlagNever)) return;
  if (there && hasFlag(kFlagChanged) && slots.items[slot].content.xy == uvec2(low, high)) return;
  slots.items[slot].owner.z = meta.matter.z;
  slots.items[slot].content.xy = uvec2(low, high);
  atomicAdd(Counters(meta.ramps.zw).value.wanted.w, 1u);
  Words(meta.spare.zw).items[atomicAdd(Rounds(meta.rounds.xy).items[0].blocks.x, 1u)] = slot;
}

void main() {
  const uint i = gl_LocalInvocationIndex;
  const uint cell = Words(meta.items.xy).items[gl_WorkGroupID.x];
  const uint slot = positionOf(cellOf(cell));
  const uvec2 list = Pairs(meta.lists.xy).items[slot];
  if (i == 0u) low = high = meta.matter.w;
  barrier();
  for (uint at = i; at < list.y; at += 64u) addHash(hashOf(Words(meta.entries.xy).items[list.x + at]));
  if (i < meta.limits.z && (wordOf(cell) >> (kVolumeBit + i) & 1u) != 0u) {
    const uvec4 two = meta.contents[i / 2u];
    addHash(i % 2u == 0u ? two.xy : two.zw);
  }
  barrier();
  if (i == 0u) claim(slot);
}
