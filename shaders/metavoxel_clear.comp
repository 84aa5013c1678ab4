// No shadow on the scene: the shadow pass writes only where something is. (A device's own clear of a storage image may
// be slow: 56 GB/s were seen.)
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel.glsl"

layout(local_size_x = 16, local_size_y = 16) in;
layout(set = 1, binding = 4, r32f) writeonly uniform image2D shadow;

void main() {
  const ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(texel, imageSize(shadow)))) imageStore(shadow, texel, vec4(0.0));
}
