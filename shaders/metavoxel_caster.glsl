// Where the scene cuts off the light of a column of voxels, and what share of a voxel lies before that.
#ifndef BILLOW_METAVOXEL_CASTER
#define BILLOW_METAVOXEL_CASTER

#include "metavoxel.glsl"

layout(set = 1, binding = 8) uniform texture2D sceneShadow;
layout(constant_id = 7) const bool kSceneShadow = true;  // there is one

const float kNoCaster = 1e30;
const uint kMostCasters = 16u;

float casters[kMostCasters];  // z of the scene's surface at points of the column's section
uint casterCount = 0u;
vec2 casterSpan = vec2(kNoCaster);  // least and largest of them

// z of the surface in a texel of the map, if its slope across a texel is that of the map's plane.
float casterIn(ivec2 texel, float plane) {
  if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, textureSize(sceneShadow, 0)))) return kNoCaster;
  const float value = texelFetch(sceneShadow, texel, 0).r;
  const bool some = value != meta.mapAt.z && abs(value) < 3e38;
  return some ? meta.mapZ.x * value + plane : kNoCaster;
}

// Between four texels: one surface where they are near each other, else the one of two that most of the place is of, its
// edge where both have the same share.
float casterAt(vec2 voxel) {
  const vec2 at = meta.mapStep.xy * voxel.x + meta.mapStep.zw * voxel.y + meta.mapAt.xy - 0.5;
  // Beyond any map, and no number of a texel.
  if (any(greaterThan(abs(at), vec2(1e6)))) return kNoCaster;
  const float plane = dot(meta.mapZ.yz, voxel) + meta.mapZ.w;
  const ivec2 first = ivec2(floor(at));
  const vec2 f = at - vec2(first);
  const vec4 z = vec4(casterIn(first, plane), casterIn(first + ivec2(1, 0), plane),
                      casterIn(first + ivec2(0, 1), plane), casterIn(first + ivec2(1, 1), plane));
  const vec4 weight = vec4(1.0 - f.x, f.x, 1.0 - f.x, f.x) * vec4(1.0 - f.y, 1.0 - f.y, f.y, f.y);
  const float least = min(min(z.x, z.y), min(z.z, z.w));
  const float most = max(max(z.x, z.y), max(z.z, z.w));
  const float texel = inversesqrt(min(dot(meta.mapStep.xy, meta.mapStep.xy),
                                      dot(meta.mapStep.zw, meta.mapStep.zw)));
  vec4 share = weight;
  if (most - least > max(1.5 * texel, 1.0)) {
    const vec4 near = weight * vec4(lessThan(z, vec4(0.5 * (least + most))));
    const float part = near.x + near.y + near.z + near.w;
    share = part >= 0.5 ? near : weight - near;
    share /= share.x + share.y + share.z + share.w;
  }
  return dot(share, z);
}

// For the column of voxels whose middle is at `voxel`.
void findCasters(vec2 voxel) {
  if (!kSceneShadow) return;
  const uint along = uint(meta.mapAt.w);
  casterCount = along * along;
  casterSpan = vec2(kNoCaster, -kNoCaster);
  for (uint i = 0u; i < casterCount; ++i) {
    casters[i] = casterAt(voxel + (vec2(i % along, i / along) + 0.5) / float(along) - 0.5);
    casterSpan = vec2(min(casterSpan.x, casters[i]), max(casterSpan.y, casters[i]));
  }
}

// Share of the column's voxel about z that the sun shines on, were nothing but the scene in its way.
float sunnyShare(float z) {
  if (!kSceneShadow || z + 0.5 <= casterSpan.x) return 1.0;
  if (z - 0.5 >= casterSpan.y) return 0.0;
  float sum = 0.0;
  for (uint i = 0u; i < casterCount; ++i) sum += clamp(casters[i] - (z - 0.5), 0.0, 1.0);
  return sum / float(casterCount);
}

#endif
