// The viewer's picture as its window shows it: exposed, tone-mapped, in 8 bits.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tone.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, rgba32f) readonly uniform image2D light;
layout(set = 0, binding = 1, rgba8) writeonly uniform image2D screen;

layout(push_constant) uniform Push {
  float gain;
}
push;

void main() {
  const ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, imageSize(screen)))) return;
  const vec3 color = imageLoad(light, at).rgb * push.gain;
  vec3 levels;
  for (int c = 0; c < 3; ++c) levels[c] = shown(color[c], float(at.x), float(at.y));
  imageStore(screen, at, vec4(levels / 255.0, 1));
}
