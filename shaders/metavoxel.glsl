// Bindings, buffers and coordinates of the metavoxel passes.
#ifndef BILLOW_METAVOXEL
#define BILLOW_METAVOXEL

#include "bindings.glsl"
#include "metavoxel_interface.h"

layout(set = 1, binding = 0, std140) uniform MetavoxelBlock { MetavoxelParams meta; };

layout(push_constant) uniform PassBlock {
  uint round;    // of the pool; of the light field's passes: how often light has been scattered on
  uint volume;   // number, of passes for one layer of a volume
  uint finish;   // 1: the picture is complete after this round
  uint level;    // of the light field's pyramid; of the pass that fills, number of the volume's layer
  uvec4 box;     // first cell of the volume's box, of the pass that bins it; 0
}
pass;

layout(buffer_reference, std430, buffer_reference_align = 4) buffer Words { uint items[]; };
layout(buffer_reference, std430, buffer_reference_align = 8) buffer Pairs { uvec2 items[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Quads { uvec4 items[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Floats { float items[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Counters { MetavoxelCounters value; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Rounds { MetavoxelRound items[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer Slots { MetavoxelSlot items[]; };

uint cellsAxis() { return meta.space.x; }
uint edgeTexels() { return meta.space.y; }
uint innerVoxels() { return meta.space.z; }
bool hasFlag(uint flag) { return (meta.space.w & flag) != 0u; }

// Numbers are made of bits: a division by what is no constant takes as long as thirty other operations.
uint cellBits() { return meta.picture.w; }
uint cellNumber(uvec3 cell) { return (cell.z << cellBits() | cell.y) << cellBits() | cell.x; }
uvec3 cellOf(uint number) {
  const uint mask = (1u << cellBits()) - 1u;
  return uvec3(number & mask, number >> cellBits() & mask, number >> 2u * cellBits());
}

// World relative to the space's centre.
vec3 worldOf(vec3 voxel) {
  const vec3 v = voxel - vec3(meta.toWorld[0].w, meta.toWorld[1].w, meta.toWorld[2].w);
  return meta.toWorld[0].xyz * v.x + meta.toWorld[1].xyz * v.y + meta.toWorld[2].xyz * v.z;
}
vec3 voxelOf(vec3 world) {
  return vec3(dot(meta.toVoxel[0].xyz, world), dot(meta.toVoxel[1].xyz, world), dot(meta.toVoxel[2].xyz, world)) +
         vec3(meta.toVoxel[0].w, meta.toVoxel[1].w, meta.toVoxel[2].w);
}
// The same for a way, not a place.
vec3 voxelsAlong(vec3 way) {
  return vec3(dot(meta.toVoxel[0].xyz, way), dot(meta.toVoxel[1].xyz, way), dot(meta.toVoxel[2].xyz, way));
}

// Centre of a texel of a cell's metavoxel. Made from the number of the voxel in the space, so that neighbours agree to
// the bit about what they share.
vec3 texelVoxel(uvec3 cell, uvec3 texel) { return vec3(ivec3(cell * innerVoxels() + texel) - 1) + 0.5; }

// A cell grown by its border: what can change a filtered read in it has a part in here.
void grownCell(uvec3 cell, out vec3 low, out vec3 high) {
  low = vec3(cell * innerVoxels()) - 0.5;
  high = vec3((cell + 1u) * innerVoxels()) + 0.5;
}

uvec3 slotCorner(uint slot) {
  const uvec2 mask = (uvec2(1u) << meta.pool.xy) - 1u;
  const uint row = slot >> meta.pool.x;
  return uvec3(slot & mask.x, row & mask.y, row >> meta.pool.y) * edgeTexels();
}
uint texelNumber(uint slot, uvec3 texel) {
  return ((slot * edgeTexels() + texel.z) * edgeTexels() + texel.y) * edgeTexels() + texel.x;
}

uint blocksAxis() { return (edgeTexels() + kSubBlock - 1u) / kSubBlock; }
uint blockNumber(uint slot, uvec3 block) {
  const uint n = blocksAxis();
  return ((slot * n + block.z) * n + block.y) * n + block.x;
}
uint blockHolds(uint slot, uvec3 block) { return Words(meta.rounds.zw).items[blockNumber(slot, block)]; }

// In the round whose range this is, by number: of the metavoxels drawn, and of those to fill.
uint drawnSlot(uvec4 range, uint number) {
  if (range.w == 0u) return number;
  return Words(meta.cells.zw).items[Words(meta.items.xy).items[number]] - 1u;
}
uint filledSlot(uvec4 range, uint number) {
  return range.w == 0u ? number : Words(meta.spare.zw).items[number];
}

uint positionOf(uvec3 cell) { return Words(meta.cells.zw).items[cellNumber(cell)] - 1u; }  // kNone where nothing is
uint cellAt(uint position) { return Words(meta.items.zw).items[position]; }
uint wordOf(uint cell) { return Words(meta.cells.xy).items[cell]; }

// Three numbers in 9 bits each with a common exponent of 5 bits (Vulkan's E5B9G9R9), in [0, 65408].
uint packRgb9e5(vec3 color) {
  const vec3 c = clamp(color, vec3(0.0), vec3(65408.0));
  const float largest = max(max(c.r, c.g), max(c.b, 1.0 / 33554432.0));
  int exponent = int(floor(log2(largest))) + 1;
  exponent = max(exponent, -15);
  if (round(largest * exp2(float(9 - exponent))) >= 512.0) ++exponent;
  const uvec3 m = min(uvec3(c * exp2(float(9 - exponent)) + 0.5), 511u);
  return m.r | m.g << 9 | m.b << 18 | uint(exponent + 15) << 27;
}
vec3 unpackRgb9e5(uint word) {
  const vec3 m = vec3(word & 511u, word >> 9 & 511u, word >> 18 & 511u);
  return m * exp2(float(word >> 27) - 24.0);
}

#endif
