// What a workgroup of the fill passes writes: a block of kSubBlock^3 texels of one metavoxel of the round, two texels a
// thread.
#ifndef BILLOW_METAVOXEL_BLOCK
#define BILLOW_METAVOXEL_BLOCK

#include "metavoxel_pool.glsl"
#include "metavoxel_work.glsl"

layout(local_size_x = 8, local_size_y = 8, local_size_z = 4) in;

layout(constant_id = 6) const bool kWeighted = false;  // colours are means weighted by extinction, not maxima

struct Block {
  uint slot;
  uvec3 cell;
  uvec3 at;     // among the metavoxel's blocks
  uvec3 texel;  // the block's first
};

Block blockOf(uvec2 item) {
  Block block;
  block.slot = (item.x & ~kAfterVolumes) >> 9;
  block.cell = cellOf(item.y);
  block.at = uvec3(item.x, item.x >> 3, item.x >> 6) & 7u;
  block.texel = block.at * kSubBlock;
  return block;
}

// The thread's first or second texel.
uvec3 texelOf(Block block, uint i) {
  return block.texel + uvec3(gl_LocalInvocationID.xy, gl_LocalInvocationID.z + 4u * i);
}

shared uint held;     // by the block: kBlockMatter, kBlockEmission
shared uint touched;  // bit of each of the 27 blocks around that a texel with matter is in or beside

// Bits of the blocks that a texel is in or beside: of an axis 1, 2 and 4 for the one before, its own and the next one,
// and all their products.
uint touchedBy(uvec3 inBlock) {
  const uvec3 along = 2u | uvec3(equal(inBlock, uvec3(0u))) | uvec3(equal(inBlock, uvec3(kSubBlock - 1u))) << 2;
  const uint y = (along.y & 1u) | (along.y & 2u) << 2 | (along.y & 4u) << 4;
  const uint z = (along.z & 1u) | (along.z & 2u) << 8 | (along.z & 4u) << 16;
  return along.x * y * z;
}

// Most texels find their bits set: an atomic operation on one word is slow when a whole group asks for it.
void noteMatter(uvec3 inBlock, bool emits) {
  const uint holds = kBlockMatter | (emits ? kBlockEmission : 0u);
  if ((held & holds) != holds) atomicOr(held, holds);
  const uint bits = touchedBy(inBlock);
  if ((touched & bits) != bits) atomicOr(touched, bits);
}

// Colour of two amounts of extinction that meet.
vec3 blended(Texel a, Texel b) {
  if (!kWeighted) return max(a.albedo, b.albedo);
  return (a.albedo * a.extinction + b.albedo * b.extinction) / max(a.extinction + b.extinction, 1e-30);
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
    values[i] = Texel(blended(old, values[i]), min(old.extinction + values[i].extinction, kLargestHalf),
                      old.emission + values[i].emission);
    // What has no extinction has no colour: in a block without matter nothing would light it.
    if (!(values[i].extinction > 0.0)) values[i].albedo = vec3(0.0);
    imageStore(pool, ivec3(slotCorner(block.slot) + texel), vec4(values[i].albedo, values[i].extinction));
    keepAlbedo(block.slot, texel, values[i].albedo);
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
  if (i == 0u && (held | before & kBlockMatter) == 0u) {
    atomicAnd(Words(meta.rounds.zw).items[blockNumber(block.slot, block.at)], ~kBlockStale);
  }
  if (i >= 27u || (touched >> i & 1u) == 0u) return;
  const uvec3 beside = block.at + uvec3(i % 3u, i / 3u % 3u, i / 9u) - 1u;
  if (any(greaterThanEqual(beside, uvec3(blocksAxis())))) return;
  atomicOr(Words(meta.rounds.zw).items[blockNumber(block.slot, beside)], kBlockNear | (i == 13u ? held : 0u));
}

#endif
