// Finds what there is to fill in the round's metavoxels, a workgroup each: blocks of texels that particles reach, blocks
// where a volume may be, and blocks that hold what is there no longer.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_particles.glsl"
#include "metavoxel_work.glsl"

layout(local_size_x = 64) in;

shared vec4 spheres[64];  // a batch of the metavoxel's particles: centre and radius, in voxels
shared uint found;        // work items of the group
shared uint firstItem;

// Whether a particle of the list reaches the thread's block of texels from `low` on.
bool reached(uvec2 list, vec3 low) {
  bool some = false;
  for (uint batch = 0u; batch < list.y; batch += 64u) {
    const uint count = min(list.y - batch, 64u);
    barrier();
    if (gl_LocalInvocationID.x < count) {
      const uint number = Words(meta.entries.xy).items[list.x + batch + gl_LocalInvocationID.x];
      Particles particles = Particles(meta.entries.zw);
      spheres[gl_LocalInvocationID.x] =
          vec4(voxelOf(particles.items[number].center), particles.items[number].radius / meta.eye.w);
    }
    barrier();
    for (uint j = 0u; j < count && !some; ++j) {
      some = meets(spheres[j].xyz, spheres[j].w, low, low + float(kSubBlock - 1u));
    }
  }
  return some;
}

void addFills(bool mine, uvec4 item) {
  if (gl_LocalInvocationID.x == 0u) found = 0u;
  barrier();
  const uint at = mine ? atomicAdd(found, 1u) : 0u;
  barrier();
  if (gl_LocalInvocationID.x == 0u && found != 0u) {
    firstItem = atomicAdd(Rounds(meta.rounds.xy).items[pass.round].fill.w, found);
    atomicMax(Rounds(meta.rounds.xy).items[pass.round].fill.y, workRows(firstItem + found));
  }
  barrier();
  if (mine) Quads(meta.work.zw).items[firstItem + at] = item;
}

uvec3 blockAt(uint number) {
  const uint n = blocksAxis();
  return uvec3(number % n, number / n % n, number / (n * n));
}

void addVolumes(uint slot, uint cell, uint blocks) {
  barrier();  // the place of the last items of particles has been read
  if (gl_LocalInvocationID.x == 0u) {
    firstItem = atomicAdd(Rounds(meta.rounds.xy).items[pass.round].volumes.w, blocks);
    atomicMax(Rounds(meta.rounds.xy).items[pass.round].volumes.y, workRows(firstItem + blocks));
  }
  barrier();
  for (uint i = gl_LocalInvocationID.x; i < blocks; i += 64u) {
    Pairs(meta.work.xy).items[firstItem + i] = uvec2(workWord(slot, blockAt(i)), cell);
  }
}

void main() {
  const uvec4 range = Rounds(meta.rounds.xy).items[pass.round].range;
  const uint slot = filledSlot(range, gl_WorkGroupID.x);
  const uint position = range.x + slot;
  const uint cell = cellAt(position);
  const uvec2 list = Pairs(meta.lists.xy).items[position];
  const bool volumes = wordOf(cell) >> kVolumeBit != 0u;
  const uint blocks = blocksAxis() * blocksAxis() * blocksAxis();
  for (uint first = 0u; first < blocks; first += 64u) {
    const uint i = first + gl_LocalInvocationID.x;
    const uvec3 at = blockAt(i);
    bool fill = reached(list, texelVoxel(cellOf(cell), at * kSubBlock));
    if (i < blocks) {
      const uint word = slot * blocks + i;
      const bool stale = (Words(meta.rounds.zw).items[word] & (kBlockMatter | kBlockStale)) != 0u;
      Words(meta.rounds.zw).items[word] = stale ? kBlockStale : 0u;
      // Where a volume may be, its pass comes first, and leaves zeros.
      fill = fill || (stale && !volumes);
    }
    const uint word = workWord(slot, at) | (volumes ? kAfterVolumes : 0u);
    addFills(fill && i < blocks, uvec4(word, cell, list));
  }
  if (volumes) addVolumes(slot, cell, blocks);
}
