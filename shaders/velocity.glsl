// The velocity that carries a layer's matter. Simulations have it only where there is gas, but gas moves on into where
// there was none: beside an active voxel the velocity is that of the active ones alone, and further out that of the
// nearest found.
#ifndef BILLOW_VELOCITY
#define BILLOW_VELOCITY

#include "lookup.glsl"

bool carries() { return kGrids >> kVelocityXSlot != 0u; }

// The grid that says which voxels are active: the components' are the same ones.
uint firstVelocity() {
  if (hasGrid(kVelocityXSlot)) return kVelocityXSlot;
  return hasGrid(kVelocityXSlot + 1u) ? kVelocityXSlot + 1u : kVelocityXSlot + 2u;
}

vec3 velocityIn(vec3 p) {
  vec3 velocity = vec3(0.0);
  for (uint i = 0u; i < 3u; ++i) {
    const uint g = kVelocityXSlot + i;
    if (hasGrid(g)) velocity[i] = sampleGrid(g, indexOf(g, p), kFilterTrilinear);
  }
  return velocity;
}

// Whether the grids say how fast everything is where no voxel is active.
bool moveEverywhere() {
  bool all = false;
  for (uint g = kVelocityXSlot; g < kGridSlots; ++g) all = all || (hasGrid(g) && BILLOW_GRID(g).boxMax.w == 0.0);
  return all;
}

// Places beside one, a number each, from near to far: half the way and the whole way to six sides and eight corners.
const uint kPlacesBeside = 28u;
bool endsRing(uint i) { return i == 5u || i == 13u || i == 19u; }
vec3 besideAt(uint i) {
  const float way = i < 14u ? 0.5 : 1.0;
  const uint k = i % 14u;
  if (k >= 6u) return mix(vec3(-way), vec3(way), notEqual(k - 6u & uvec3(1, 2, 4), uvec3(0u)));
  return mix(vec3(0.0), vec3(k < 3u ? way : -way), equal(uvec3(k % 3u), uvec3(0, 1, 2)));
}

// At p, in the world of toIndex. `far` are ways along three axes, as far as matter may be carried.
vec3 velocityAt(vec3 p, mat3 far) {
  if (moveEverywhere()) return velocityIn(p);
  const uint g = firstVelocity();
  const float share = activeShare(g, indexOf(g, p));
  if (share > 0.0) return velocityIn(p) / share;
  vec3 sum = vec3(0.0);
  float shares = 0.0;
  for (uint i = 0u; i < kPlacesBeside; ++i) {
    const vec3 beside = p + far * besideAt(i);
    const float there = activeShare(g, indexOf(g, beside));
    if (there > 0.0) sum += velocityIn(beside);
    shares += there;
    if (shares > 0.0 && endsRing(i)) break;
  }
  return sum / max(shares, 1e-6);
}

#endif
