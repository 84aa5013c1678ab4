// Light from the matter around each voxel of the light field: the mean of 26 cones that widen from level to level of the
// pyramid, each dimmed by what lies before (Crassin, Neyret, Sainz, Green, Eisemann 2011, "Interactive indirect
// illumination using voxel cone tracing"). Directions and weights are Lebedev's quadrature of 26 points, which weights
// all directions fairly. Where nothing dims it, a small source's light falls off with the square of the distance, 15 % more
// or less from place to place; narrower cones spread more, wider ones see round what they should not.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_field.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(set = 1, binding = 11, rgba16f) writeonly uniform image3D fieldTexels;

const float kSphere = 12.5663706;         // 4 pi
const float kDark = 1.0 / 1024.0;         // transmittance at which a cone ends
const float kShares[3] = float[3](1.0 / 21.0, 4.0 / 105.0, 9.0 / 280.0);  // through faces, edges and corners of a cube

// What a cone of this width, in voxels of the field, sees at a place.
vec4 readWide(vec3 at, float width) {
  const float level = min(log2(width), float(meta.field.z - 1u));
  const uint lower = min(uint(level), meta.field.z - 2u);
  const float size = exp2(float(lower));
  return mix(readLevel(lower, at / size), readLevel(lower + 1u, at / (2.0 * size)), level - float(lower));
}

// Radiance along a cone of width `slope` at distance 1. Its steps are as long as it is wide.
vec3 coneLight(vec3 from, vec3 way, float slope) {
  const vec3 last = vec3(fieldEdge());
  vec3 light = vec3(0.0);
  float transmittance = 1.0;
  float t = 0.0;
  while (transmittance > kDark) {
    const float dt = max(1.0, slope * t / (1.0 - 0.5 * slope));
    const float width = max(1.0, slope * (t + 0.5 * dt));
    const vec3 at = from + way * (t + 0.5 * dt);
    // Half of its width reaches in. (A way of 1, 1, 1 leaves by 0.58 of its length, and widens by 0.64.)
    if (any(lessThan(at, vec3(-0.5 * width))) || any(greaterThan(at, last + 0.5 * width))) break;
    const vec4 value = readWide(at, width);
    const float edges = dt * meta.fieldScale.x;
    const float depth = value.a * edges;
    const float after = exp(-depth);
    light += transmittance * value.rgb * (depth < 1e-3 ? edges * (1.0 - 0.5 * depth) : (1.0 - after) / value.a);
    transmittance *= after;
    t += dt;
  }
  return light;
}

void main() {
  const uvec3 voxel = gl_GlobalInvocationID;
  if (any(greaterThanEqual(voxel, uvec3(fieldEdge())))) return;
  const vec3 from = vec3(voxel) + 0.5;
  vec3 light = vec3(0.0);
  // Where there is no matter, nor beside, nobody asks. Level 1 reaches as far.
  const bool asked = readLevel(1u, from / 2.0).a > 0.0;
  for (uint i = 0u; i < 27u && asked; ++i) {
    const ivec3 side = ivec3(i % 3u, i / 3u % 3u, i / 9u) - 1;
    const uint sides = uint(dot(abs(side), ivec3(1)));
    if (sides == 0u) continue;
    const float share = kShares[sides - 1u];
    light += share * coneLight(from, normalize(vec3(side)), 0.8 * sqrt(kSphere * share));
  }
  imageStore(fieldTexels, ivec3(voxel), vec4(min(light, vec3(65504.0)), 0.0));
}
