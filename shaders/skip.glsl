// Where along a ray a grid can be skipped. Used by primary rays only: on shadow rays skipping costs more than it saves.
#ifndef BILLOW_SKIP
#define BILLOW_SKIP

#include "lookup.glsl"

const float kFar = 3.0e38;

struct Ray {  // in one grid's pack index space; t is the distance in world units
  vec3 origin;
  vec3 direction;
  vec3 inverse;
};

Ray makeRay(uint g, vec3 from, vec3 along) {
  const vec4 x = BILLOW_GRID(g).toIndex[0];
  const vec4 y = BILLOW_GRID(g).toIndex[1];
  const vec4 z = BILLOW_GRID(g).toIndex[2];
  Ray ray;
  ray.origin = vec3(dot(x.xyz, from), dot(y.xyz, from), dot(z.xyz, from)) + vec3(x.w, y.w, z.w);
  ray.direction = vec3(dot(x.xyz, along), dot(y.xyz, along), dot(z.xyz, along));
  const vec3 safe = mix(ray.direction, vec3(1e-12), lessThan(abs(ray.direction), vec3(1e-12)));
  ray.inverse = 1.0 / safe;
  return ray;
}

// Entry and exit of a box; empty where x > y.
vec2 crossBox(Ray ray, vec3 low, vec3 high) {
  const vec3 a = (low - ray.origin) * ray.inverse;
  const vec3 b = (high - ray.origin) * ray.inverse;
  const vec3 near = min(a, b);
  const vec3 far = max(a, b);
  return vec2(max(max(near.x, near.y), near.z), min(min(far.x, far.y), far.z));
}

vec2 crossGrid(uint g, Ray ray) {
  return crossBox(ray, BILLOW_GRID(g).boxMin.xyz, BILLOW_GRID(g).boxMax.xyz);
}

// Log2 of the voxels that the skippable node around `cell` spans: 7 for an absent Node4, 3 for an absent Node3;
// 0 where something is.
uint absentSpanLog2(uint g, uvec3 cell, bool dense) {
  uint node4;
  if (dense) {
    node4 = WordArray(BILLOW_GRID(g).tableAndRecords.xy).items[node5Bit(cell)] - 1u;
  } else {
    node4 = treeNode4(g, cell);
  }
  if (node4 == kNone) return BILLOW_GRID(g).cellDim.w == 0 ? kNode4SpanLog2 : 0u;
  if (dense) {
    const uint record = WordArray(BILLOW_GRID(g).masksAndNode4.zw).items[node4 * 4096u + node4Bit(cell)];
    return record == 0u ? kNode3SpanLog2 : 0u;
  }
  if (treeChild(g, node4, cell) != kNone) return 0u;
  const uint absent = WordArray(BILLOW_GRID(g).masksAndNode4.zw).items[node4 * kTreeNode4Words + 1u];
  return absent == 0u ? kNode3SpanLog2 : 0u;
}

// The skippable box around p, in voxels; false where p must be sampled.
bool emptyBox(uint g, vec3 p, out vec3 low, out vec3 high) {
  // A nearest lookup at p reads voxel floor(p + 1/2); a trilinear one floor(p) and its upper neighbours.
  const float shift = kFilter == kFilterTrilinear ? 0.0 : 0.5;
  const ivec3 cell = ivec3(floor(p + shift)) >> 3;
  const ivec3 local = cell - BILLOW_GRID(g).cellMin.xyz;
  if (any(greaterThanEqual(uvec3(local), uvec3(BILLOW_GRID(g).cellDim.xyz)))) return false;
  const uint kind = indexKind(g);
  if (kind == kIndexFlat) {
    const uint entry = flatEntry(g, local);
    if (entry < kSkip) return false;
    const int reach = int(entry & 0xffu);
    low = vec3((cell - (reach - 1)) * 8) - shift;
    high = vec3((cell + reach) * 8) - shift;
    return true;
  }
  const uint span = absentSpanLog2(g, uvec3(cell), kind == kIndexDense);
  if (span == 0u) return false;
  const ivec3 corner = (cell * 8 >> span) << span;
  low = vec3(corner) - shift;
  // The last layer's upper taps reach into the neighbour, so it is sampled.
  high = vec3(corner + (1 << span)) - (kFilter == kFilterTrilinear ? 1.0 : 0.5);
  return all(lessThan(p, high));
}

// The first distance from t on at which this grid may hold something: t itself, or further, or kFar.
float skipEmpty(uint g, Ray ray, float t) {
  const vec2 range = crossGrid(g, ray);
  if (range.x >= range.y || t >= range.y) return kFar;
  if (t < range.x) return range.x;
  if (BILLOW_GRID(g).boxMax.w == 0.0) return t;
  vec3 low, high;
  const vec3 p = ray.origin + ray.direction * t;
  if (!emptyBox(g, p, low, high)) return t;
  const float exit = crossBox(ray, low, high).y;
  return exit >= range.y ? kFar : max(exit, t);
}

#endif
