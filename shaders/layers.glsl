// What the direct march reads of several layers, or of one that is carried along its velocity: their sum.
#ifndef BILLOW_LAYER_SUM
#define BILLOW_LAYER_SUM

#include "medium.glsl"
#include "velocity.glsl"

struct Matter {
  float extinction;
  vec3 emission;
};

struct Rays {  // from the eye; in each grid's space it is made where it is needed, for there are many
  vec3 direction;
};

Rays raysAlong(vec3 direction) { return Rays(direction); }

// By how much the layer's matter is carried at the velocity of a place (world, relative to the eye).
vec3 wayAt(vec3 p) {
  const vec4 x = layers[layerNow].flow[0];
  const vec4 y = layers[layerNow].flow[1];
  const vec4 z = layers[layerNow].flow[2];
  const vec3 most = vec3(x.w, y.w, z.w);
  const vec3 velocity = velocityAt(p, mat3(most.x, 0.0, 0.0, 0.0, most.y, 0.0, 0.0, 0.0, most.z));
  return clamp(vec3(dot(x.xyz, velocity), dot(y.xyz, velocity), dot(z.xyz, velocity)), -most, most);
}

// Where what is now at p was in the layer's frame, as metavoxel_carry.glsl has it.
vec3 carriedFrom(vec3 p) { return carries() ? p - wayAt(p - 0.5 * wayAt(p)) : p; }

Matter matterAt(Rays rays, float t) {
  Matter sum = Matter(0.0, vec3(0.0));
  for (layerNow = 0u; layerNow < kLayers; ++layerNow) {
    const vec3 p = carriedFrom(rays.direction * t);
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
    const vec3 p = carriedFrom(shadow.from + params.sun.xyz * t);
    sum += layers[layerNow].share.x * extinctionOf(sampleGrid(extinctionSlot(), indexOf(extinctionSlot(), p), kShadow));
  }
  return sum;
}

#endif
