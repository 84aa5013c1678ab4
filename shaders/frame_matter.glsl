// What the direct march reads of a frame drawn alone and as it is; layers.glsl has the same of several.
#ifndef BILLOW_FRAME_MATTER
#define BILLOW_FRAME_MATTER

#include "medium.glsl"

struct Matter {
  float extinction;
  vec3 emission;
};

struct Rays {  // from the eye, one in each grid's space
  Ray grids[kMatterSlots];
};

Rays raysAlong(vec3 direction) {
  Rays rays;
  for (uint g = 0u; g < kMatterSlots; ++g) rays.grids[g] = makeRay(g, vec3(0.0), direction);
  return rays;
}

Matter matterAt(Rays rays, float t) {
  float value[kMatterSlots];
  for (uint g = 0u; g < kMatterSlots; ++g) {
    value[g] = hasGrid(g) ? sampleGrid(g, rays.grids[g].origin + rays.grids[g].direction * t, kFilter) : 0.0;
  }
  Matter matter = Matter(extinctionOf(value[extinctionSlot()]), vec3(0.0));
  if (hasGrid(kTemperatureSlot) || hasGrid(kFlamesSlot)) {
    matter.emission = emissionOf(value[kTemperatureSlot], value[kFlamesSlot]);
  }
  return matter;
}

// Edge of the smallest voxels, as the rays cross them.
float finestVoxel(Rays rays) {
  float voxel = kFar;
  for (uint g = 0u; g < kMatterSlots; ++g) {
    if (hasGrid(g)) voxel = min(voxel, 1.0 / length(rays.grids[g].direction));
  }
  return voxel;
}

float nextOccupied(Rays rays, float t) {
  float next = kFar;
  for (uint g = 0u; g < kMatterSlots; ++g) {
    if (hasGrid(g)) next = min(next, skipEmpty(g, rays.grids[g], t));
  }
  return next;
}

float endOfGrids(Rays rays) {
  float end = 0.0;
  for (uint g = 0u; g < kMatterSlots; ++g) {
    const vec2 range = crossGrid(g, rays.grids[g]);
    if (hasGrid(g) && range.x < range.y) end = max(end, range.y);
  }
  return end;
}

struct ShadowRay {
  Ray ray;
  float exit;  // distance at which it leaves the grid
};

// From p (world, relative to the eye) to the sun, and how many voxels it crosses.
ShadowRay shadowRay(vec3 p, out float voxels) {
  const uint g = extinctionSlot();
  ShadowRay shadow;
  shadow.ray = makeRay(g, p, params.sun.xyz);
  shadow.exit = crossGrid(g, shadow.ray).y;
  voxels = shadow.exit * length(shadow.ray.direction);
  return shadow;
}

float shadowExtinction(ShadowRay shadow, float t) {
  return extinctionOf(sampleGrid(extinctionSlot(), shadow.ray.origin + shadow.ray.direction * t, kShadow));
}

#endif
