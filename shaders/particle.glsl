// A particle's density and colours at a point, as billow/format/particle.h says.
#ifndef BILLOW_PARTICLE
#define BILLOW_PARTICLE

#include "billow/format/noise.h"
#include "metavoxel_particles.glsl"

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Materials { ParticleMaterial items[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Ramps { vec4 items[]; };

layout(set = 1, binding = 3) uniform sampler3D cubes;  // faces along z
layout(constant_id = 5) const uint kUses = 7u;         // of the materials

vec3 rotated(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

// Vulkan 1.3, table "Cube map face and coordinate selection".
float sampleCube(uint map, vec3 direction) {
  const vec3 a = abs(direction);
  uint face;
  vec3 d;  // along the face's u, its v, and the major axis's size
  if (a.z >= a.x && a.z >= a.y) {
    face = direction.z < 0.0 ? 5u : 4u;
    d = vec3(direction.z < 0.0 ? -direction.x : direction.x, -direction.y, a.z);
  } else if (a.y >= a.x) {
    face = direction.y < 0.0 ? 3u : 2u;
    d = vec3(direction.x, direction.y < 0.0 ? -direction.z : direction.z, a.y);
  } else {
    face = direction.x < 0.0 ? 1u : 0u;
    d = vec3(direction.x < 0.0 ? direction.z : -direction.z, -direction.y, a.x);
  }
  const vec2 share = d.z > 0.0 ? d.xy / d.z * 0.5 + 0.5 : vec2(0.5);
  const float texels = float(kCubeFaceTexels);
  const vec2 at = (share * (texels - 2.0) + 1.0) / texels;
  return textureLod(cubes, vec3(at, (float(map * kCubeLayers + face) + 0.5) * meta.tint.w), 0.0).r;
}

float sampleCurve(uint row, float x) {
  const float at = clamp(x, 0.0, 1.0) * float(kCurveSamples - 1u);
  const uint i = min(uint(at), kCurveSamples - 2u);
  const uint first = row * kCurveSamples + i;
  Floats curves = Floats(meta.tables.zw);
  return mix(curves.items[first], curves.items[first + 1u], at - float(i));
}

vec3 sampleRamp(uint row, float r, float age) {
  const vec2 at = clamp(vec2(r, age), 0.0, 1.0) * vec2(kRampRadii - 1u, kRampAges - 1u);
  const uvec2 i = min(uvec2(at), uvec2(kRampRadii - 2u, kRampAges - 2u));
  const vec2 f = at - vec2(i);
  const uint first = (row * kRampAges + i.y) * kRampRadii + i.x;
  Ramps ramps = Ramps(meta.ramps.xy);
  return mix(mix(ramps.items[first].rgb, ramps.items[first + 1u].rgb, f.x),
             mix(ramps.items[first + kRampRadii].rgb, ramps.items[first + kRampRadii + 1u].rgb, f.x), f.y);
}

// Share of the way from the middle to the surface before displacement.
float shareOf(Particle particle, vec3 q) {
  const vec3 shape = particle.shape;
  const uint kind = kindIn(particle.kind);
  if (kind == kKindSphere) return length(q) / particle.radius;
  if (kind == kKindEllipsoid) return length(q / shape);
  if (kind == kKindBox) {
    const vec3 sides = abs(q) / shape;
    return max(max(sides.x, sides.y), sides.z);
  }
  const float along = clamp(dot(q, shape) / max(dot(shape, shape), 1e-30), -1.0, 1.0);
  return length(q - along * shape) / (particle.radius - length(shape));
}

float displacementMap(Particle particle, vec3 q) {
  if (particle.map == kNoMap) return 1.0;
  const float first = sampleCube(firstMapIn(particle.map), q);
  const float share = mapShareIn(particle.kind);
  return share > 0.0 ? mix(first, sampleCube(secondMapIn(particle.map), q), share) : first;
}

float profileOf(ParticleMaterial material, float r) {
  if (material.profile == kProfileRadial) return 1.0 - r * r;
  return (kUses & kUseCurves) != 0u && material.profile == kProfileCurve ? clamp(sampleCurve(material.profileRow, r), 0.0, 1.0) : 1.0;
}

struct Matter {  // per world unit
  float extinction;
  vec3 diffuse;
  vec3 emission;
};

// False where the particle has no density. `apart` is the way from its centre, inside of the bounding sphere.
bool matterAt(Particle particle, ParticleMaterial material, vec3 apart, out Matter matter) {
  matter = Matter(0.0, vec3(0.0), vec3(0.0));
  const vec4 turn = vec4(-particle.rotation.xyz, particle.rotation.w);
  const vec3 q = rotated(turn, apart);
  const float s = shareOf(particle, q);
  if (!(s < 1.0)) return false;
  const float m = displacementMap(particle, q);
  const float r = s / (1.0 - particle.displacement * (1.0 - m));
  if (!(r < 1.0)) return false;
  float density = profileOf(material, r) * clamp((1.0 - r) / material.softness, 0.0, 1.0);
  if ((kUses & kUseErosion) != 0u && material.erosion > 0.0) {
    const vec3 at = q * (material.erosionFrequency / particle.radius);
    density *= clamp(1.0 - material.erosion + erosionNoise(at.x, at.y, at.z, particle.seed), 0.0, 1.0);
  }
  if (!(density > 0.0)) return false;
  matter.extinction = density * particle.extinction;
  matter.diffuse = particle.diffuse * (1.0 - material.occlusion * (1.0 - m));
  const bool ramps = (kUses & kUseRamps) != 0u;
  if (ramps && material.diffuseRamp != kNoRow) matter.diffuse *= sampleRamp(material.diffuseRamp, r, particle.age);
  matter.emission = density * particle.emission;
  if (ramps && material.emissionRamp != kNoRow) matter.emission *= sampleRamp(material.emissionRamp, r, particle.age);
  return true;
}

#endif
