// The direct method: one thread a pixel marches the node tree itself.
// BILLOW_COLOR_FORMAT is rgba16f or rgba32f; with BILLOW_LAYERS it draws the sum of several layers.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "light.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 2, BILLOW_COLOR_FORMAT) writeonly uniform image2D colorImage;
layout(set = 0, binding = 3, r32f) writeonly uniform image2D depthImage;

const float kOpaque = 1.0 / 1024.0;      // transmittance at which a ray ends
const float kNegligible = 1.0 / 2048.0;  // share of a pixel for which light is not computed anew

struct Sum {
  vec3 radiance;
  float transmittance;
  float depth;  // distance weighted by opacity
  vec3 light;   // in-scattered radiance at the last sample that asked for it
};

// One step of length dt centred on distance t. The source is constant over the step, its own extinction included:
// (1 - exp(-s dt)) / s (Hillaire 2015, "Physically based and unified volumetric rendering in Frostbite").
void shade(Rays rays, vec3 direction, float t, float dt, inout Sum sum) {
  const Matter matter = matterAt(rays, t);
  const float extinction = matter.extinction;
  vec3 source = matter.emission;
  const float opticalDepth = extinction * dt;
  const float after = exp(-opticalDepth);
  // Light is what costs; where a sample can hardly be seen its predecessor's will do.
  const bool seen = sum.transmittance * (1.0 - after) > kNegligible || sum.light.x < 0.0;
  if (extinction > 0.0 && seen) {
    sum.light = scatteredSun(direction * t, dot(direction, params.sun.xyz)) + params.ambient.rgb;
  }
  if (extinction > 0.0) source += params.albedo.rgb * extinction * sum.light;
  const float span = opticalDepth < 1e-3 ? dt * (1.0 - 0.5 * opticalDepth) : (1.0 - after) / extinction;
  sum.radiance += sum.transmittance * source * span;
  sum.depth += sum.transmittance * (1.0 - after) * t;
  sum.transmittance *= after;
}

// A fixed pattern in [0, 1) that hides banding (Jimenez 2014, "Next generation post processing in Call of Duty").
float interleavedNoise(vec2 pixel) { return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))); }

// Length of a step that starts at distance t: so many voxels, but never less than a pixel.
float stepLength(float voxel, float t) { return max(params.forward.w * voxel, t * params.right.w); }

Sum march(vec3 direction, vec2 pixel) {
  const Rays rays = raysAlong(direction);
  const float voxel = finestVoxel(rays);
  Sum sum = Sum(vec3(0.0), 1.0, 0.0, vec3(-1.0));
  const float end = endOfGrids(rays);
  // Not below 1/8: a step far below the others would only cost time.
  float shift = params.size.w != 0u ? 0.125 + 0.875 * interleavedNoise(pixel) : 0.0;
  float t = 0.0;
  while (t < end && sum.transmittance > kOpaque) {
    const float next = nextOccupied(rays, t);
    if (next > t) {
      t = next;
      continue;
    }
    float dt = min(stepLength(voxel, t), end - t);
    if (shift > 0.0) dt *= shift;  // the first step alone is cut, so that all later ones are displaced
    shift = 0.0;
    shade(rays, direction, t + 0.5 * dt, dt, sum);
    const float after = t + dt;
    if (after <= t) break;  // a step below the precision of t would never end
    t = after;
  }
  return sum;
}

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  const ivec2 size = ivec2(params.size.xy);
  if (any(greaterThanEqual(pixel, size))) return;
  const vec2 unit = (vec2(pixel) + 0.5) / vec2(size);
  const vec3 along =
      params.forward.xyz + (2.0 * unit.x - 1.0) * params.right.xyz + (1.0 - 2.0 * unit.y) * params.up.xyz;
  const vec3 direction = normalize(along);
  const Sum sum = march(direction, vec2(pixel));
  const float opacity = 1.0 - sum.transmittance;
  const vec3 behind = mix(params.background[0].rgb, params.background[1].rgb, 1.0 - unit.y) * params.up.w;
  const vec4 color = vec4(sum.radiance + sum.transmittance * behind, mix(opacity, 1.0, params.up.w));
  const float depth = opacity > kOpaque ? sum.depth / opacity * dot(direction, params.forward.xyz) : uintBitsToFloat(0x7f800000u);
  imageStore(colorImage, pixel, color);
  imageStore(depthImage, pixel, vec4(depth));
}
