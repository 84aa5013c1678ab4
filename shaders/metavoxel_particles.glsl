// The particles of a draw. Their centres are relative to the space's centre.
#ifndef BILLOW_METAVOXEL_PARTICLES
#define BILLOW_METAVOXEL_PARTICLES

#include "billow/format/particle.h"
#include "metavoxel.glsl"

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Particles { Particle items[]; };

// Whether a sphere has a point in a box.
bool meets(vec3 center, float radius, vec3 low, vec3 high) {
  const vec3 apart = max(max(low - center, center - high), vec3(0.0));
  return dot(apart, apart) <= radius * radius;
}

#endif
