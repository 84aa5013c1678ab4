// From a position to a value: the index (which record covers a cell of 8^3 voxels) and the two filters.
#ifndef BILLOW_LOOKUP
#define BILLOW_LOOKUP

#include "brick.glsl"

// From the world, relative to the eye, to pack index space.
vec3 indexOf(uint g, vec3 p) {
  const vec4 x = BILLOW_GRID(g).toIndex[0];
  const vec4 y = BILLOW_GRID(g).toIndex[1];
  const vec4 z = BILLOW_GRID(g).toIndex[2];
  return vec3(dot(x.xyz, p), dot(y.xyz, p), dot(z.xyz, p)) + vec3(x.w, y.w, z.w);
}

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
  return rankedChild(WordArray(BILLOW_GRID(g).tableAndRecords.xy), 0u, 1024u, node5Bit(cell));
}

uint treeChild(uint g, uint node4, uvec3 cell) {
  const uint at = node4 * kTreeNode4Words;
  return rankedChild(WordArray(BILLOW_GRID(g).masksAndNode4.zw), at + 2u, at + 130u, node4Bit(cell));
}

uint flatEntry(uint g, ivec3 local) {
  const ivec3 dim = BILLOW_GRID(g).cellDim.xyz;
  return WordArray(BILLOW_GRID(g).tableAndRecords.xy).items[(local.x * dim.y + local.y) * dim.z + local.z];
}

uint findInTree(uint g, uvec3 cell) {
  const uint node4 = treeNode4(g, cell);
  if (node4 == kNone) return uint(BILLOW_GRID(g).cellDim.w);
  WordArray node = WordArray(BILLOW_GRID(g).masksAndNode4.zw);
  const uint child = treeChild(g, node4, cell);
  if (child == kNone) return node.items[node4 * kTreeNode4Words + 1u];
  return WordArray(BILLOW_GRID(g).children.xy).items[node.items[node4 * kTreeNode4Words] + child];
}

uint findInDense(uint g, uvec3 cell) {
  const uint node4 = WordArray(BILLOW_GRID(g).tableAndRecords.xy).items[node5Bit(cell)];
  if (node4 == 0u) return uint(BILLOW_GRID(g).cellDim.w);
  return WordArray(BILLOW_GRID(g).masksAndNode4.zw).items[(node4 - 1u) * 4096u + node4Bit(cell)];
}

uint indexKind(uint g) { return kIndexKind == kIndexMixed ? uint(BILLOW_GRID(g).cellMin.w) : kIndexKind; }

// The record of the cell (pack index >> 3); 0, the background, outside of the active box.
uint findRecord(uint g, ivec3 cell) {
  const ivec3 local = cell - BILLOW_GRID(g).cellMin.xyz;
  if (any(greaterThanEqual(uvec3(local), uvec3(BILLOW_GRID(g).cellDim.xyz)))) return 0u;
  const uint kind = indexKind(g);
  if (kind == kIndexTree) return findInTree(g, uvec3(cell));
  if (kind == kIndexDense) return findInDense(g, uvec3(cell));
  const uint entry = flatEntry(g, local);
  return entry >= kSkip ? 0u : entry;
}

float getVoxel(uint g, ivec3 voxel) {
  const uint number = findRecord(g, voxel >> 3);
  if (number == 0u) return BILLOW_GRID(g).boxMin.w;
  return recordVoxel(g, loadRecord(g, number), uvec3(voxel & 7));
}

// The eight voxels around a place, whose centres are at integers. Two thirds of them lie in one brick; else each brick
// has some.
struct Footprint {
  ivec3 cell;     // of the first voxel
  uvec3 inner;    // the first voxel in its brick
  bvec3 crosses;  // the axes along which the others lie in the next brick
  uint axes;      // the same as bits
  vec3 fraction;  // of the way to the others
};

Footprint footprintAt(vec3 p) {
  const vec3 base = floor(p);
  const ivec3 voxel = ivec3(base);
  const uvec3 inner = uvec3(voxel & 7);
  const bvec3 crosses = equal(inner, uvec3(7u));
  const uint axes = uint(crosses.x) | uint(crosses.y) << 1 | uint(crosses.z) << 2;
  return Footprint(voxel >> 3, inner, crosses, axes, p - base);
}

// What of it lies in one brick: `beyond` are the axes along which that is the next one, every subset of `axes`.
struct Part {
  ivec3 cell;
  uvec3 corner;  // of the brick's voxels, the lower
  Weights weights;
};

Part partOf(Footprint at, uint beyond) {
  const bvec3 next = notEqual(beyond & uvec3(1, 2, 4), uvec3(0u));
  const vec3 f = at.fraction;
  // In a brick before a face the upper corner is the last voxel, behind a face the lower corner is the first.
  const Weights w = Weights(mix(mix(1.0 - f, vec3(0.0), at.crosses), f, next),
                            mix(mix(f, 1.0 - f, at.crosses), vec3(0.0), next));
  return Part(at.cell + ivec3(next), mix(min(at.inner, 6u), uvec3(0u), next), w);
}

// Exact trilinear interpolation: what each brick adds.
float sampleTrilinear(uint g, vec3 p) {
  const Footprint at = footprintAt(p);
  float sum = 0.0;
  uint beyond = 0u;
  do {
    const Part part = partOf(at, beyond);
    const uint number = findRecord(g, part.cell);
    if (number == 0u) {
      sum += BILLOW_GRID(g).boxMin.w * totalWeight(part.weights);
    } else {
      sum += recordCorners(g, loadRecord(g, number), part.corner, part.weights);
    }
    beyond = beyond - at.axes & at.axes;
  } while (beyond != 0u);
  return sum;
}

// How much of such an interpolation is of active voxels.
float activeShare(uint g, vec3 p) {
  const Footprint at = footprintAt(p);
  float share = 0.0;
  uint beyond = 0u;
  do {
    const Part part = partOf(at, beyond);
    const uint number = findRecord(g, part.cell);
    if (number != 0u) share += activeWeight(g, loadRecord(g, number), part.corner, part.weights);
    beyond = beyond - at.axes & at.axes;
  } while (beyond != 0u);
  return share;
}

float sampleGrid(uint g, vec3 p, uint how) {
  if (how == kFilterTrilinear) return sampleTrilinear(g, p);
  return getVoxel(g, ivec3(floor(p + 0.5)));
}

#endif
