// Sun light inside the volume. sunTransmittance() is the only way in which the march asks for it.
#ifndef BILLOW_LIGHT
#define BILLOW_LIGHT

#include "phase.glsl"
#ifdef BILLOW_LAYERS
#include "layers.glsl"
#else
#include "frame_matter.glsl"
#endif

// Share of the sun's light that reaches p (world, relative to the eye), by marching towards the sun. The reference
// mode; a cached light volume has this signature too.
float sunTransmittance(vec3 p) {
  if (kShadow == kFilterNone) return 1.0;
  float voxels;
  const ShadowRay ray = shadowRay(p, voxels);
  const float exit = ray.exit;
  if (exit <= 0.0) return 1.0;
  const int count = int(clamp(ceil(voxels / params.albedo.w), 1.0, float(params.size.z)));
  const float dt = exit / float(count);
  float opticalDepth = 0.0;
  for (int i = 0; i < count; ++i) {
    opticalDepth += shadowExtinction(ray, (float(i) + 0.5) * dt) * dt;
    if (opticalDepth > 12.0) break;
  }
  return exp(-opticalDepth);
}

// Radiance scattered towards the eye per unit of scattering.
vec3 scatteredSun(vec3 p, float cosine) { return params.sunLight.rgb * scatteredShare(sunTransmittance(p), cosine); }

#endif
