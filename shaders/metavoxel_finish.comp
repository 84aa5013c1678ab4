// The picture after its last round.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require

#include "metavoxel_picture.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(pixel, ivec2(params.size.xy)))) storePicture(pixel, loadSum(pixel));
}
