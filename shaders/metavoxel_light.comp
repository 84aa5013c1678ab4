// Light through the round's metavoxels, a thread a column: what each voxel gives off towards the eye.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_samplerless_texture_functions : require

#include "metavoxel_caster.glsl"
#include "metavoxel_column.glsl"
#include "metavoxel_field.glsl"
#include "phase.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

vec3 sunAt(float depth, vec3 voxel) {
  const float cosine = dot(normalize(worldOf(voxel) - meta.eye.xyz), params.sun.xyz);
  if (meta.tint.rgb == vec3(1.0)) return params.sunLight.rgb * scatteredShare(exp(-depth), cosine);
  const vec3 arrives = exp(-depth * meta.tint.rgb);
  return params.sunLight.rgb * vec3(scatteredShare(arrives.r, cosine), scatteredShare(arrives.g, cosine),
                                    scatteredShare(arrives.b, cosine));
}

// Lights one texel; `depth` is that of the light that reaches it, and then that of what leaves it.
void lightTexel(Column column, uint z, uint holds, inout float depth) {
  const uvec3 texel = uvec3(column.texel, z);
  const Texel matter = loadTexel(column.slot, texel, holds);
  const float through = lightDepth(matter.extinction);
  // The first texel is the border, which the light has left behind.
  if (z == 0u) depth -= through;
  vec3 radiance = matter.emission;
  if (matter.extinction > 0.0) {
    const vec3 voxel = texelVoxel(column.cell, texel);
    const vec3 sun = sunnyShare(voxel.z) * sunAt(max(depth + 0.5 * through, 0.0), voxel);
    radiance += matter.albedo * matter.extinction * (sun + params.ambient.rgb + surroundingsAt(voxel));
  }
  depth += through;
  imageStore(pool, ivec3(slotCorner(column.slot) + texel),
             vec4(clamp(radiance, vec3(-kLargestHalf), vec3(kLargestHalf)), matter.extinction));
}

void main() {
  const Column column = columnOf();
  if (any(greaterThanEqual(column.texel, uvec2(edgeTexels())))) return;
  findCasters(texelVoxel(column.cell, uvec3(column.texel, 0u)).xy);
  float depth = depthAbove(column.cell, column.texel);
  for (uint block = 0u; block < blocksAxis(); ++block) {
    const uint holds = blockHolds(column.slot, uvec3(column.block, block));
    if ((holds & kBlockMatter) == 0u) continue;
    const uvec2 range = texelsOf(block);
    for (uint z = range.x; z < range.y; ++z) lightTexel(column, z, holds, depth);
  }
}
