// A record (GpuRecord) and the values of its voxels, to the bit as format::reconstruct gives them.
//
// Trilinear lookups read eight voxels of a brick at once, its corners: v + (dx, dy, dz), each 0 or 1, in the order of
// dx * 4 + dy * 2 + dz; a slab is the four of one dx. So the encoding is asked once, neighbours along z share their
// words, and cells and masks are loaded once a slab.
#ifndef BILLOW_BRICK
#define BILLOW_BRICK

#include "bindings.glsl"

struct Record {
  uint brick;  // encoding << kEncodingShift | slot of the atlas or of 32 bytes
  uint mask;   // GPU mask number, kMaskAll or kMaskTexel
  float lo;
  float scale;
};

Record loadRecord(uint g, uint number) {
  const uvec4 words = QuadArray(BILLOW_GRID(g).tableAndRecords.zw).items[number - 1u];
  return Record(words.x, words.y, uintBitsToFloat(words.z), uintBitsToFloat(words.w));
}

uint encodingOf(Record record) { return record.brick >> kEncodingShift; }
uint slotOf(Record record) { return record.brick & kBrickUnitMask; }

// ---- BC7: 8x8x2 texels of the atlas, four stored z in the channels of each.

// Exchanges the packed axis and z.
uvec3 storedOrder(uint encoding, uvec3 v) {
  if (encoding == kEncodingBc7Y) return v.xzy;
  return encoding == kEncodingBc7X ? v.zyx : v;
}
vec3 storedOrder(uint encoding, vec3 v) {
  if (encoding == kEncodingBc7Y) return v.xzy;
  return encoding == kEncodingBc7X ? v.zyx : v;
}

// The same of eight bits, one a corner: corners 1, 5 and 2, 6 change places (y and z), or 1, 3 and 4, 6 (x and z).
uint storedCorners(uint encoding, uint bits) {
  if (encoding == kEncodingBc7Z) return bits;
  const uint by = encoding == kEncodingBc7Y ? 1u : 3u;
  const uint differ = (bits ^ bits >> by) & (encoding == kEncodingBc7Y ? 0x22u : 0x0au);
  return bits ^ differ ^ differ << by;
}

ivec3 atlasCorner(uint slot) {
  const uint xBits = BILLOW_BRICKS.x & 0xffu;
  const uint yBits = BILLOW_BRICKS.x >> 8;
  const uvec3 at = uvec3(slot & ((1u << xBits) - 1u), slot >> xBits & ((1u << yBits) - 1u), slot >> (xBits + yBits));
  return ivec3(at) * ivec3(8, 8, 2);
}

#ifdef BILLOW_LAYERS
vec4 atlasTexel(ivec3 at) {
  if (kLayers > 1u && layerNow == 1u) return texelFetch(atlasOfSecond, at, 0);
  if (kLayers > 2u && layerNow == 2u) return texelFetch(atlasOfThird, at, 0);
  if (kLayers > 3u && layerNow == 3u) return texelFetch(atlasOfFourth, at, 0);
  return texelFetch(atlasBc7, at, 0);
}
#else
vec4 atlasTexel(ivec3 at) { return texelFetch(atlasBc7, at, 0); }
#endif

vec4 nearestInteger(vec4 texel) { return floor(texel * 255.0 + 0.5); }

vec4 bc7Slab(ivec3 at, uint channel) {
  const vec4 near = atlasTexel(at);
  const vec4 far = atlasTexel(at + ivec3(0, 1, 0));
  if (channel < 3u) return nearestInteger(vec4(near[channel], near[channel + 1u], far[channel], far[channel + 1u]));
  const float nearNext = atlasTexel(at + ivec3(0, 0, 1)).r;
  const float farNext = atlasTexel(at + ivec3(0, 1, 1)).r;
  return nearestInteger(vec4(near.a, nearNext, far.a, farNext));
}

// ---- Uniform and local: an index of 1 to 8 or 16 bits a voxel, little-endian; local: cells of 4x4x2 voxels before it.

bool isLocal(uint encoding) { return encoding >= kEncodingLocal2; }

uint indexBits(uint encoding) {
  if (isLocal(encoding)) return encoding - kEncodingLocal2 + 2u;
  return encoding == kEncodingUniform16 ? 16u : encoding - kEncodingUniform1 + 1u;
}

// Number of the slot's word in which the indices begin.
uint firstIndexWord(uint encoding, uint slot) { return slot * 8u + (isLocal(encoding) ? 8u : 0u); }

// The indices of a voxel and of the next along z.
uvec2 indexPair(uint firstWord, uint bits, uint voxel) {
  WordArray words = WordArray(BILLOW_BRICKS.zw);
  const uint bit = voxel * bits;
  const uint at = firstWord + (bit >> 5);
  const uint shift = bit & 31u;
  // Behind the last brick lie the indices of grids, so the second word may always be read.
  const uint both = words.items[at] >> shift | words.items[at + 1u] << 1 << (31u - shift);
  return uvec2(both, both >> bits) & ((1u << bits) - 1u);
}

// Base and top, one byte each, of the cell at z of the four cells that lie along z.
uint cellEnds(uvec2 cells, uint z) { return (z < 4u ? cells.x : cells.y) >> (z << 3 & 16u); }

uvec4 localTexels(uvec4 ends, uvec4 index, uint bits) {
  return (ends & 0xffu) * (((1u << bits) - 1u) - index) + (ends >> 8 & 0xffu) * index;
}

uvec4 localSlab(uint slot, uvec3 v, uvec4 index, uint bits) {
  const uvec4 cells = QuadArray(BILLOW_BRICKS.zw).items[slot * 2u + (v.x >> 2)];
  const uvec2 near = v.y < 4u ? cells.xy : cells.zw;
  const uvec2 far = v.y < 3u ? cells.xy : cells.zw;
  const uvec4 ends = uvec4(cellEnds(near, v.z), cellEnds(near, v.z + 1u), cellEnds(far, v.z), cellEnds(far, v.z + 1u));
  return localTexels(ends, index, bits);
}

uvec4 indexSlab(uint encoding, uint slot, uvec3 v) {
  const uint bits = indexBits(encoding);
  const uint first = firstIndexWord(encoding, slot);
  const uint voxel = v.x << 6 | v.y << 3 | v.z;
  return uvec4(indexPair(first, bits, voxel), indexPair(first, bits, voxel + 8u));
}

// ---- Coarse: 4x4x4 bytes at the centres of 2^3 voxels, interpolated.

// Sixteen times the rows of four values, interpolated at (x, y): z 0 and 2 in the halves of .x, 1 and 3 in those of .y.
uvec2 coarseRow(uint slot, uint x, uint y) {
  WordArray words = WordArray(BILLOW_BRICKS.zw);
  uvec2 sum = uvec2(0u);
  for (uint tap = 0u; tap < 4u; ++tap) {
    const ivec2 upper = ivec2(tap >> 1, tap & 1u);
    const ivec2 low = (ivec2(x, y) - 1) >> 1;
    const uvec2 at = uvec2(clamp(low + upper, 0, 3));
    const uvec2 weight = mix(uvec2(1u), uvec2(3u), equal(ivec2(x, y) & 1, 1 - upper));
    const uint word = words.items[slot * 8u + at.x * 4u + at.y];
    sum += weight.x * weight.y * (uvec2(word, word >> 8) & 0x00ff00ffu);
  }
  return sum;
}

uint coarseValue(uvec2 row, int z) { return ((z & 1) == 0 ? row.x : row.y) >> (uint(z) << 3 & 16u) & 0xffffu; }

uint coarseTexel(uvec2 row, uint z) {
  const int low = (int(z) - 1) >> 1;
  const uint lowWeight = (z & 1u) == 0u ? 1u : 3u;
  return lowWeight * coarseValue(row, max(low, 0)) + (4u - lowWeight) * coarseValue(row, min(low + 1, 3));
}

uvec4 coarseSlab(uint slot, uvec3 v) {
  const uvec2 near = coarseRow(slot, v.x, v.y);
  const uvec2 far = coarseRow(slot, v.x, v.y + 1u);
  return uvec4(coarseTexel(near, v.z), coarseTexel(near, v.z + 1u), coarseTexel(far, v.z), coarseTexel(far, v.z + 1u));
}

// ---- One voxel

bool maskBit(uint g, uint mask, uvec3 v) {
  const uint bit = v.x << 6 | v.y << 3 | v.z;
  return (WordArray(BILLOW_GRID(g).masksAndNode4.xy).items[mask * 16u + (bit >> 5)] >> (bit & 31u) & 1u) != 0u;
}

// The stored integer of voxel v (each component 0 to 7); `index` is not changed where the encoding has none.
float voxelTexel(Record record, uvec3 v, inout uint index) {
  const uint encoding = encodingOf(record);
  const uint slot = slotOf(record);
  if (encoding == kEncodingConstant) return 0.0;
  if (encoding <= kEncodingBc7X) {
    const uvec3 s = storedOrder(encoding, v);
    return nearestInteger(atlasTexel(atlasCorner(slot) + ivec3(s.xy, s.z >> 2)))[s.z & 3u];
  }
  if (encoding == kEncodingCoarse) return float(coarseTexel(coarseRow(slot, v.x, v.y), v.z));
  const uint bits = indexBits(encoding);
  index = indexPair(firstIndexWord(encoding, slot), bits, v.x << 6 | v.y << 3 | v.z).x;
  if (!isLocal(encoding)) return float(index);
  const uvec2 cells = PairArray(BILLOW_BRICKS.zw).items[slot * 4u + (v.x >> 2) * 2u + (v.y >> 2)];
  return float(localTexels(uvec4(cellEnds(cells, v.z)), uvec4(index), bits).x);
}

float recordVoxel(uint g, Record record, uvec3 v) {
  uint index = 0u;
  const float texel = voxelTexel(record, v, index);
  bool present = true;
  if (record.mask == kMaskTexel) present = index != 0u;
  if (record.mask < kMaskTexel) present = maskBit(g, record.mask, v);
  if (!present) return BILLOW_GRID(g).boxMin.w;
  precise const float product = record.scale * texel;
  precise const float value = record.lo + product;
  return value;
}

// ---- Eight voxels

// Weights of the lower and the upper corners along each axis.
struct Weights {
  vec3 low;
  vec3 high;
};

float weighted(vec4 lower, vec4 upper, Weights w) {
  const vec4 alongX = lower * w.low.x + upper * w.high.x;
  const vec2 alongY = alongX.xy * w.low.y + alongX.zw * w.high.y;
  return alongY.x * w.low.z + alongY.y * w.high.z;
}

float totalWeight(Weights w) {
  const vec3 sum = w.low + w.high;
  return sum.x * sum.y * sum.z;
}

uint maskSlab(uvec2 words, uvec3 v) {
  const uint near = (v.y < 4u ? words.x : words.y) >> ((v.y & 3u) << 3 | v.z) & 3u;
  const uint far = (v.y < 3u ? words.x : words.y) >> ((v.y + 1u & 3u) << 3 | v.z) & 3u;
  return near | far << 2;
}

uint maskCorners(uint g, uint mask, uvec3 v) {
  PairArray masks = PairArray(BILLOW_GRID(g).masksAndNode4.xy);
  return maskSlab(masks.items[mask * 8u + v.x], v) | maskSlab(masks.items[mask * 8u + v.x + 1u], v) << 4;
}

uint nonZero(uvec4 index) {
  const uvec4 bits = min(index, uvec4(1u));
  return bits.x | bits.y << 1 | bits.z << 2 | bits.w << 3;
}

// The weights of those corners that are active.
float activeWeight(uint g, Record record, uvec3 v, Weights w) {
  if (record.mask == kMaskAll) return totalWeight(w);
  uint present = 0u;
  if (record.mask < kMaskTexel) {
    present = maskCorners(g, record.mask, v);
  } else {  // such bricks have indices
    const uint slot = slotOf(record);
    present = nonZero(indexSlab(encodingOf(record), slot, v)) |
              nonZero(indexSlab(encodingOf(record), slot, v + uvec3(1, 0, 0))) << 4;
  }
  const uvec4 bits = uvec4(1u, 2u, 4u, 8u);
  return weighted(vec4(min(present & bits, uvec4(1u))), vec4(min(present >> 4 & bits, uvec4(1u))), w);
}

// The sum of the corners' values, each times its weights. v is at most 6 along each axis.
float recordCorners(uint g, Record record, uvec3 v, Weights w) {
  const uint encoding = encodingOf(record);
  const uint slot = slotOf(record);
  vec4 lower = vec4(0.0);
  vec4 upper = vec4(0.0);
  uint present = 0xffu;
  if (record.mask < kMaskTexel) present = maskCorners(g, record.mask, v);
  if (encoding == kEncodingCoarse) {
    lower = vec4(coarseSlab(slot, v));
    upper = vec4(coarseSlab(slot, v + uvec3(1, 0, 0)));
  } else if (encoding > kEncodingBc7X) {
    const uvec3 next = v + uvec3(1, 0, 0);
    uvec4 lowerTexel = indexSlab(encoding, slot, v);
    uvec4 upperTexel = indexSlab(encoding, slot, next);
    if (record.mask == kMaskTexel) present = nonZero(lowerTexel) | nonZero(upperTexel) << 4;
    if (isLocal(encoding)) {
      lowerTexel = localSlab(slot, v, lowerTexel, indexBits(encoding));
      upperTexel = localSlab(slot, next, upperTexel, indexBits(encoding));
    }
    lower = vec4(lowerTexel);
    upper = vec4(upperTexel);
  } else if (encoding != kEncodingConstant) {
    const uvec3 s = storedOrder(encoding, v);
    w = Weights(storedOrder(encoding, w.low), storedOrder(encoding, w.high));
    present = storedCorners(encoding, present);
    const ivec3 at = atlasCorner(slot) + ivec3(s.xy, s.z >> 2);
    lower = bc7Slab(at, s.z & 3u);
    upper = bc7Slab(at + ivec3(1, 0, 0), s.z & 3u);
  }
  if (present == 0xffu) return record.lo * totalWeight(w) + record.scale * weighted(lower, upper, w);
  const vec4 inactive = vec4(BILLOW_GRID(g).boxMin.w);
  const uvec4 bits = uvec4(1u, 2u, 4u, 8u);
  lower = mix(inactive, record.lo + record.scale * lower, notEqual(present & bits, uvec4(0u)));
  upper = mix(inactive, record.lo + record.scale * upper, notEqual(present >> 4 & bits, uvec4(0u)));
  return weighted(lower, upper, w);
}

#endif
