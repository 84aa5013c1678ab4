// A record (GpuRecord) and the value of one of its voxels, to the bit as format::reconstruct gives it.
#ifndef BILLOW_BRICK
#define BILLOW_BRICK

#include "bindings.glsl"

struct Record {
  uint brick;  // encoding << kEncodingShift | atlas slot
  uint mask;   // GPU mask number, kMaskAll or kMaskTexel
  float lo;
  float scale;
};

Record loadRecord(uint g, uint number) {
  const uvec4 words = QuadArray(params.grids[g].tableAndRecords.zw).items[number - 1u];
  return Record(words.x, words.y, uintBitsToFloat(words.z), uintBitsToFloat(words.w));
}

ivec3 slotCorner(uint slot, uint layoutBits, ivec3 slotTexels) {
  const uint xBits = layoutBits & 0xffu;
  const uint yBits = layoutBits >> 8;
  const uvec3 at = uvec3(slot & ((1u << xBits) - 1u), slot >> xBits & ((1u << yBits) - 1u), slot >> (xBits + yBits));
  return ivec3(at) * slotTexels;
}

uint toInteger(float texel) { return uint(texel * 255.0 + 0.5); }

// BC4 by integers, as format::decodeBc4Block has it: the nearest integer to what the block interpolates.
uint bc4Texel(uint slot, uvec3 v) {
  const uvec2 block = PairArray(params.atlas.zw).items[slot * 32u + v.z * 4u + (v.y >> 2) * 2u + (v.x >> 2)];
  const uint bit = 16u + 3u * ((v.y & 3u) * 4u + (v.x & 3u));
  const uint low = bit < 32u ? block.x >> bit : block.y >> (bit - 32u);
  const uint index = (bit == 31u ? low | block.y << 1 : low) & 7u;
  const uint a = block.x & 0xffu;
  const uint b = block.x >> 8 & 0xffu;
  if (index < 2u) return index == 0u ? a : b;
  if (a > b) return (2u * ((8u - index) * a + (index - 1u) * b) + 7u) / 14u;
  if (index > 5u) return index == 6u ? 0u : 255u;
  return (2u * ((6u - index) * a + (index - 1u) * b) + 5u) / 10u;
}

// The stored integer of voxel v (each component 0 to 7).
uint fetchTexel(uint brick, ivec3 v) {
  const uint encoding = brick >> kEncodingShift;
  const uint slot = brick & kBrickUnitMask;
  if (encoding == kEncodingConstant) return 0u;
  if (encoding <= kEncodingBc4X) {
    if (encoding == kEncodingBc7Y || encoding == kEncodingBc4Y) v = v.xzy;
    if (encoding == kEncodingBc7X || encoding == kEncodingBc4X) v = v.zyx;
  }
  if (encoding <= kEncodingBc7X) {
    const vec4 texel = texelFetch(atlasBc7, slotCorner(slot, params.atlas.x, ivec3(8, 8, 2)) + ivec3(v.xy, v.z >> 2), 0);
    return toInteger(texel[v.z & 3]);
  }
  if (encoding <= kEncodingBc4X) {
    return bc4Texel(slot, uvec3(v));
  }
  const uint low = toInteger(texelFetch(atlasR8, slotCorner(slot, params.atlas.y, ivec3(8)) + v, 0).r);
  if (encoding == kEncodingR8) return low;
  return low | toInteger(texelFetch(atlasR8, slotCorner(slot + 1u, params.atlas.y, ivec3(8)) + v, 0).r) << 8;
}

bool isActive(uint g, uint mask, uint texel, ivec3 v) {
  if (mask == kMaskAll) return true;
  if (mask == kMaskTexel) return texel != 0u;
  const uint bit = uint(v.x) << 6 | uint(v.y) << 3 | uint(v.z);
  return (WordArray(params.grids[g].masksAndNode4.xy).items[mask * 16u + (bit >> 5)] >> (bit & 31u) & 1u) != 0u;
}

float recordVoxel(uint g, Record record, ivec3 v) {
  const uint texel = fetchTexel(record.brick, v);
  if (!isActive(g, record.mask, texel, v)) return params.grids[g].boxMin.w;
  precise const float product = record.scale * float(texel);
  precise const float value = record.lo + product;
  return value;
}

#endif
