// From a position to a value: the index (which record covers a cell of 8^3 voxels) and the two filters.
#ifndef BILLOW_LOOKUP
#define BILLOW_LOOKUP

#include "brick.glsl"

uint node5Bit(uvec3 cell) { return (cell.x >> 4) << 10 | (cell.y >> 4) << 5 | cell.z >> 4; }
uint node4Bit(uvec3 cell) { return (cell.x & 15u) << 8 | (cell.y & 15u) << 4 | (cell.z & 15u); }

// Bit `bit` of a mask, beside which lie 16-bit counts of the bits before each of its words: the child's number, or kNone.
uint rankedChild(WordArray words, uint maskAt, uint ranksAt, uint bit) {
  const uint word = words.items[maskAt + (bit >> 5)];
  const uint rank = words.items[ranksAt + (bit >> 6)] >> (bit >> 1 & 16u) & 0xffffu;
  const uint below = bit & 31u;
  if ((word >> below & 1u) == 0u) return kNone;
  return rank + uint(bitCount(word & ((1u << below) - 1u)));
}

uint treeNode4(uint g, uvec3 cell) {
  return rankedChild(WordArray(params.grids[g].tableAndRecords.xy), 0u, 1024u, node5Bit(cell));
}

uint treeChild(uint g, uint node4, uvec3 cell) {
  const uint at = node4 * kTreeNode4Words;
  return rankedChild(WordArray(params.grids[g].masksAndNode4.zw), at + 2u, at + 130u, node4Bit(cell));
}

uint flatEntry(uint g, ivec3 local) {
  const ivec3 dim = params.grids[g].cellDim.xyz;
  return WordArray(params.grids[g].tableAndRecords.xy).items[(local.x * dim.y + local.y) * dim.z + local.z];
}

uint findInTree(uint g, uvec3 cell) {
  const uint node4 = treeNode4(g, cell);
  if (node4 == kNone) return uint(params.grids[g].cellDim.w);
  WordArray node = WordArray(params.grids[g].masksAndNode4.zw);
  const uint child = treeChild(g, node4, cell);
  if (child == kNone) return node.items[node4 * kTreeNode4Words + 1u];
  return WordArray(params.grids[g].children.xy).items[node.items[node4 * kTreeNode4Words] + child];
}

uint findInDense(uint g, uvec3 cell) {
  const uint node4 = WordArray(params.grids[g].tableAndRecords.xy).items[node5Bit(cell)];
  if (node4 == 0u) return uint(params.grids[g].cellDim.w);
  return WordArray(params.grids[g].masksAndNode4.zw).items[(node4 - 1u) * 4096u + node4Bit(cell)];
}

uint indexKind(uint g) { return kIndexKind == kIndexMixed ? uint(params.grids[g].cellMin.w) : kIndexKind; }

// The record of the cell (pack index >> 3); 0, the background, outside of the active box.
uint findRecord(uint g, ivec3 cell) {
  const ivec3 local = cell - params.grids[g].cellMin.xyz;
  if (any(greaterThanEqual(uvec3(local), uvec3(params.grids[g].cellDim.xyz)))) return 0u;
  const uint kind = indexKind(g);
  if (kind == kIndexTree) return findInTree(g, uvec3(cell));
  if (kind == kIndexDense) return findInDense(g, uvec3(cell));
  const uint entry = flatEntry(g, local);
  return entry >= kSkip ? 0u : entry;
}

float getVoxel(uint g, ivec3 voxel) {
  const uint number = findRecord(g, voxel >> 3);
  if (number == 0u) return params.grids[g].boxMin.w;
  return recordVoxel(g, loadRecord(g, number), voxel & 7);
}

float mixCorners(float c[8], vec3 f) {
  const vec4 alongX = mix(vec4(c[0], c[1], c[2], c[3]), vec4(c[4], c[5], c[6], c[7]), f.x);
  const vec2 alongY = mix(alongX.xy, alongX.zw, f.y);
  return mix(alongY.x, alongY.y, f.z);
}

// Exact trilinear interpolation between voxel centres, which are at integers. Two thirds of the footprints lie in one
// brick and need one record.
float sampleTrilinear(uint g, vec3 p) {
  const vec3 base = floor(p);
  const ivec3 voxel = ivec3(base);
  const ivec3 inner = voxel & 7;
  float c[8];
  if (all(lessThan(inner, ivec3(7)))) {
    const uint number = findRecord(g, voxel >> 3);
    if (number == 0u) return params.grids[g].boxMin.w;
    const Record record = loadRecord(g, number);
    if (record.brick >> kEncodingShift == kEncodingConstant && record.mask == kMaskAll) return record.lo;
    for (int i = 0; i < 8; ++i) c[i] = recordVoxel(g, record, inner + ivec3(i >> 2, i >> 1 & 1, i & 1));
  } else {
    for (int i = 0; i < 8; ++i) c[i] = getVoxel(g, voxel + ivec3(i >> 2, i >> 1 & 1, i & 1));
  }
  return mixCorners(c, p - base);
}

float sampleGrid(uint g, vec3 p, uint how) {
  if (how == kFilterTrilinear) return sampleTrilinear(g, p);
  return getVoxel(g, ivec3(floor(p + 0.5)));
}

#endif
