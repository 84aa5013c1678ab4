// The picture while it is drawn round by round: radiance and transmittance, and depth weighted by opacity.
// BILLOW_COLOR_FORMAT is rgba16f or rgba32f.
#ifndef BILLOW_METAVOXEL_PICTURE
#define BILLOW_METAVOXEL_PICTURE

#include "metavoxel.glsl"

layout(set = 1, binding = 5, BILLOW_COLOR_FORMAT) uniform image2D colorImage;
layout(set = 1, binding = 6, r32f) uniform image2D depthImage;

const float kOpaque = 1.0 / 1024.0;  // transmittance at which a ray ends

struct Sum {
  vec3 radiance;
  float transmittance;
  float depth;
};

Sum loadSum(ivec2 pixel) {
  const vec4 color = imageLoad(colorImage, pixel);
  return Sum(color.rgb, color.a, imageLoad(depthImage, pixel).r);
}
void storeSum(ivec2 pixel, Sum sum) {
  imageStore(colorImage, pixel, vec4(sum.radiance, sum.transmittance));
  imageStore(depthImage, pixel, vec4(sum.depth));
}

Sum inFront(Sum front, Sum back) {
  return Sum(front.radiance + front.transmittance * back.radiance, front.transmittance * back.transmittance,
             front.depth + front.transmittance * back.depth);
}

// What the host gets, as the direct march gives it.
void storePicture(ivec2 pixel, Sum sum) {
  const float height = (float(pixel.y) + 0.5) / float(params.size.y);
  const vec3 behind = mix(params.background[0].rgb, params.background[1].rgb, 1.0 - height) * params.up.w;
  const float opacity = 1.0 - sum.transmittance;
  imageStore(colorImage, pixel,
             vec4(sum.radiance + sum.transmittance * behind, mix(opacity, 1.0, params.up.w)));
  imageStore(depthImage, pixel, vec4(opacity > kOpaque ? sum.depth / opacity : uintBitsToFloat(0x7f800000u)));
}

#endif
