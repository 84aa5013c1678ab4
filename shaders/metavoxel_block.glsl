// What a workgroup of the fill passes writes: a block of kSubBlock^3 texels of one metavoxel of the round, two texels a
// thread.
#ifndef BILLOW_METAVOXEL_BLOCK
#define BILLOW_METAVOXEL_BLOCK

#include "metavoxel_pool.glsl"

layout(local_size_x = 8, local_size_y = 8, local_size_z = 4) in;

struct Block {
  uint slot;
  uint position;
  uint number;  // of the cell
  uvec3 cell;
  uvec3 at;     // among the metavoxel's blocks
  uvec3 texel;  // the block's first
};

Block blockOf() {
  const uint blocks = blocksAxis();
  const uint i = gl_WorkGroupID.x;
  Block block;
  block.slot = gl_WorkGroupID.y;
  block.position = Rounds(meta.rounds.xy).items[pass.round].range.x + block.slot;
  block.number = cellAt(block.position);
  block.cell = cellOf(block.number);
  block.at = uvec3(i % blocks, i / blocks % blocks, i / (blocks * blocks));
  block.texel = block.at * kSubBlock;
  return block;
}

// The thread's first or second texel.
uvec3 texelOf(Block block, uint i) {
  return block.texel + uvec3(gl_LocalInvocationID.xy, gl_LocalInvocationID.z + 4u * i);
}

shared uint held;     // by the block: kBlockMatter, kBlockEmission
shared uint touched;  // bit of each of the 27 blocks around that a texel with matter is in or beside

// Notes matter in the block `block.at + shift`.
uint touchBit(ivec3 shift) { return 1u << uint((shift.z + 1) * 9 + (shift.y + 1) * 3 + shift.x + 1); }

void noteMatter(uvec3 inBlock, bool emits) {
  atomicOr(held, kBlockMatter | (emits ? kBlockEmission : 0u));
  const ivec3 side = ivec3(equal(inBlock, uvec3(kSubBlock - 1u))) - ivec3(equal(inBlock, uvec3(0u)));
  uint bits = 0u;
  for (uint corner = 0u; corner < 8u; ++corner) {
    bits |= touchBit(side * ivec3(notEqual(corner & uvec3(1, 2, 4), uvec3(0u))));
  }
  atomicOr(touched, bits);
}

// Writes the thread's two texels, added to what earlier passes left (`old`, of loadTexel), and what the block holds.
// Called by all threads of the group.
void storeBlock(Block block, Texel values[2], bool first) {
  if (gl_LocalInvocationIndex == 0u) {
    held = 0u;
    touched = 0u;
  }
  barrier();
  const uint before = first ? 0u : blockHolds(block.slot, block.at);
  for (uint i = 0u; i < 2u; ++i) {
    const uvec3 texel = texelOf(block, i);
    if (any(greaterThanEqual(texel, uvec3(edgeTexels())))) continue;
    const Texel old = loadTexel(block.slot, texel, before);
    values[i] = Texel(max(old.albedo, values[i].albedo), min(old.extinction + values[i].extinction, kLargestHalf),
                      old.emission + values[i].emission);
    // What has no extinction has no colour: in a block without matter nothing would light it.
    if (!(values[i].extinction > 0.0)) values[i].albedo = vec3(0.0);
    imageStore(pool, ivec3(slotCorner(block.slot) + texel), vec4(values[i].albedo, values[i].extinction));
    const bool emits = values[i].emission != vec3(0.0);
    if (emits || values[i].extinction > 0.0) noteMatter(texel - block.texel, emits);
  }
  barrier();
  for (uint i = 0u; i < 2u && (held & kBlockEmission) != 0u; ++i) {
    const uvec3 texel = texelOf(block, i);
    if (any(greaterThanEqual(texel, uvec3(edgeTexels())))) continue;
    Words(meta.texels.xy).items[texelNumber(block.slot, texel)] = packRgb9e5(values[i].emission);
  }
  const uint i = gl_LocalInvocationIndex;
  if (i >= 27u || (touched >> i & 1u) == 0u) return;
  const uvec3 beside = block.at + uvec3(i % 3u, i / 3u % 3u, i / 9u) - 1u;
  if (any(greaterThanEqual(beside, uvec3(blocksAxis())))) return;
  atomicOr(Words(meta.rounds.zw).items[blockNumber(block.slot, beside)], kBlockNear | (i == 13u ? held : 0u));
}

#endif
