// What the direct march reads of several layers: their sum. None is carried along its velocity; metavoxels do that.
#ifndef BILLOW_LAYER_SUM
#define BILLOW_LAYER_SUM

#include "medium.glsl"

struct Matter {
  float extinction;
  vec3 emission;
};

struct Rays {  // from the eye; in each grid's space it is made where it is needed, for there are many
  vec3 direction;
};

Rays raysAlong(vec3 direction) { return Rays(direction); }

Matter matterAt(Rays rays, float t) {
  Matter sum = Matter(0.0, vec3(0.0));
  for (layerNow = 0u; layerNow < kLayers; ++layerNow) {
    const vec3 p = rays.direction * t;
    float value[kMatterSlots];
    for (uint g = 0u; g < kMatterSlots; ++g) value[g] = hasGrid(g) ? sampleGrid(g, indexOf(g, p), kFilter) : 0.0;
    const float weight = layers[layerNow].share.x;
    sum.extinction += weight * extinctionOf(value[extinctionSlot()]);
    if (hasGrid(kTemperatureSlot) || hasGrid(kFlamesSlot)) {
      sum.emission += weight * emissionOf(value[kTemperatureSlot], value[kFlamesSlot]);
    }
  }
  return sum;
}

float finestVoxel(Rays rays) {
  float voxel = kFar;
  for (layerNow = 0u; layerNow < kLayers; ++layerNow) {
    for (uint g = 0u; g < kMatterSlots; ++g) {
      if (hasGrid(g)) voxel = min(voxel, 1.0 / length(makeRay(g, vec3(0.0), rays.direction).direction));
    }
  }
  return voxel;
}

// Only what all layers skip is skipped.
float nextOccupied(Rays rays, float t) {
  float next = kFar;
  for (layerNow = 0u; layerNow < kLayers; ++layerNow) {
    for (uint g = 0u; g < kMatterSlots; ++g) {
      if (hasGrid(g)) next = min(next, skipEmpty(g, makeRay(g, vec3(0.0), rays.direction), t));
    }
  }
  return next;
}

float endOfGrids(Rays rays) {
  float end = 0.0;
  for (layerNow = 0u; layerNow < kLayers; ++layerNow) {
    for (uint g = 0u; g < kMatterSlots; ++g) {
      if (!hasGrid(g)) continue;
      const vec2 range = crossGrid(g, makeRay(g, vec3(0.0), rays.direction));
      if (range.x < range.y) end = max(end, range.y);
    }
  }
  return end;
}

struct ShadowRay {
  vec3 from;
  float exit;  // distance at which it leaves the last grid
};

ShadowRay shadowRay(vec3 p, out float voxels) {
  const uint g = extinctionSlot();
  ShadowRay shadow = ShadowRay(p, 0.0);
  voxels = 0.0;
  for (layerNow = 0u; layerNow < kLayers; ++layerNow) {
    const Ray ray = makeRay(g, p, params.sun.xyz);
    const vec2 range = crossGrid(g, ray);
    if (range.x >= range.y) continue;
    shadow.exit = max(shadow.exit, range.y);
    voxels = max(voxels, range.y * length(ray.direction));
  }
  return shadow;
}

float shadowExtinction(ShadowRay shadow, float t) {
  float sum = 0.0;
  for (layerNow = 0u; layerNow < kLayers; ++layerNow) {
    const vec3 p = shadow.from + params.sun.xyz * t;
    sum += layers[layerNow].share.x * extinctionOf(sampleGrid(extinctionSlot(), indexOf(extinctionSlot(), p), kShadow));
  }
  return sum;
}

#endif
