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

Texel loadTexel(uint slot, uvec3 texel) {
  const vec4 color = imageLoad(pool, ivec3(slotCorner(slot) + texel));
  return Texel(color.rgb, color.a, unpackRgb9e5(Words(meta.texels.xy).items[texelNumber(slot, texel)]));
}
void storeTexel(uint slot, uvec3 texel, Texel value) {
  imageStore(pool, ivec3(slotCorner(slot) + texel), vec4(value.albedo, min(value.extinction, kLargestHalf)));
  Words(meta.texels.xy).items[texelNumber(slot, texel)] = packRgb9e5(value.emission);
}

// Optical depth of a voxel on the light's way. Additive for both laws of attenuation: what arrives is exp(-sum).
float lightDepth(float extinction) { return hasFlag(kFlagReciprocal) ? log(1.0 + extinction) : extinction; }

#endif
