// The pool's texels. Filled: diffuse albedo, extinction; lit: radiance, extinction; both per voxel edge. Emission lies
// beside them until they are lit.
#ifndef BILLOW_METAVOXEL_POOL
#define BILLOW_METAVOXEL_POOL

#include "metavoxel.glsl"

layout(set = 1, binding = 1, rgba16f) uniform image3D pool;

const float kLargestHalf = 65504.0;

struct Texel {
  vec3 albedo;
  float extinction;
  vec3 emission;
};

// Light is written over the pool's albedo. Where metavoxels stay filled it lies beside the pool, too.
void keepAlbedo(uint slot, uvec3 texel, vec3 albedo) {
  if (hasFlag(kFlagKeep)) Words(meta.matter.xy).items[texelNumber(slot, texel)] = packRgb9e5(albedo);
}
vec3 albedoOf(uint slot, uvec3 texel, vec3 inPool) {
  return hasFlag(kFlagKeep) ? unpackRgb9e5(Words(meta.matter.xy).items[texelNumber(slot, texel)]) : inPool;
}

// `holds` is of the texel's block.
Texel loadTexel(uint slot, uvec3 texel, uint holds) {
  if ((holds & kBlockMatter) == 0u) return Texel(vec3(0.0), 0.0, vec3(0.0));
  const vec4 color = imageLoad(pool, ivec3(slotCorner(slot) + texel));
  const bool emits = (holds & kBlockEmission) != 0u;
  const vec3 emission = emits ? unpackRgb9e5(Words(meta.texels.xy).items[texelNumber(slot, texel)]) : vec3(0.0);
  return Texel(albedoOf(slot, texel, color.rgb), color.a, emission);
}

// Optical depth of a voxel on the light's way. Additive for both laws of attenuation: what arrives is exp(-sum).
float lightDepth(float extinction) { return hasFlag(kFlagReciprocal) ? log(1.0 + extinction) : extinction; }

#endif
