// A level of what shines into the light field: the first from what its voxels hold and what they scatter on of the light
// that they were found to get, the others from the level before.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_field.glsl"

layout(local_size_x = 4, local_size_y = 4, local_size_z = 4) in;
layout(set = 1, binding = 9, rgba16f) writeonly uniform image3D pyramidTexels;

vec4 firstLevel(uvec3 at) {
  const uvec3 cell = at / fieldPerCell();
  const uint position = positionOf(cell);
  if (position == kNone) return vec4(0.0);
  const FieldMatter matter = loadMatter(matterNumber(position, at - cell * fieldPerCell()));
  vec3 light = matter.light;
  if (pass.round != 0u) light += matter.scattering * texelFetch(fieldLight, ivec3(at), 0).rgb;
  return vec4(min(light, vec3(65504.0)), matter.extinction);
}

// 1, 3, 3, 1 along each axis: the sampler's mean of two of them has the right weights.
vec4 halved(uint level, uvec3 at) {
  vec4 sum = vec4(0.0);
  for (uint corner = 0u; corner < 8u; ++corner) {
    const vec3 side = mix(vec3(-0.75), vec3(0.75), notEqual(corner & uvec3(1, 2, 4), uvec3(0u)));
    sum += readLevel(level - 1u, vec3(at) * 2.0 + 1.0 + side);
  }
  return sum / 8.0;
}

void main() {
  const uvec3 at = gl_GlobalInvocationID;
  const ivec4 place = meta.levels[pass.level];
  if (any(greaterThanEqual(at, uvec3(place.w)))) return;
  imageStore(pyramidTexels, place.xyz + ivec3(at), pass.level == 0u ? firstLevel(at) : halved(pass.level, at));
}
