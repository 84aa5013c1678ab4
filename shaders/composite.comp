// A volume's picture into the game's, a thread a pixel of the game's. The picture may be smaller: a pixel then takes from
// the texels around it those that were marched to its own surface (after Kopf, Cohen, Lischinski, Uyttendaele 2007,
// "Joint bilateral upsampling"). BILLOW_COLOR_FORMAT and BILLOW_TARGET_FORMAT are rgba16f or rgba32f.
#version 460

layout(local_size_x = 8, local_size_y = 8) in;
layout(set = 0, binding = 0, BILLOW_COLOR_FORMAT) readonly uniform image2D color;
layout(set = 0, binding = 1, r32f) readonly uniform image2D depth;       // of the picture, opacity-weighted
layout(set = 0, binding = 2, r32f) readonly uniform image2D sceneDepth;  // to which the picture was marched
layout(set = 0, binding = 3, BILLOW_TARGET_FORMAT) uniform image2D target;
layout(set = 0, binding = 4, r32f) readonly uniform image2D targetDepth;

layout(push_constant) uniform Push {
  ivec2 size;  // of the picture
  ivec2 targetSize;
  uint marchedToScene;
}
push;

const float kNear = 0.02;         // difference of depths, as a share of the lesser, of what is one surface
const float kFar = 1e30;          // any depth beyond is as good as this
const float kEnoughMatch = 0.02;  // of all four; less, and none is of the surface

struct Taps {
  vec4 color;
  float weight;
};

// 1 on the same surface, 1/2 at a difference of kNear, and next to nothing beyond.
float matchOf(float a, float b) {
  const float apart = min(abs(a - b) / max(min(a, b), 1e-30), 1e4) / kNear;
  return 1.0 / (1.0 + apart * apart * apart * apart);
}

void addTap(ivec2 texel, float surface, float weight, inout Taps taps) {
  const ivec2 at = clamp(texel, ivec2(0), push.size - 1);
  const bool marched = push.marchedToScene != 0u;
  const float scene = marched ? min(imageLoad(sceneDepth, at).r, kFar) : kFar;
  const float match = marched ? matchOf(scene, surface) : 1.0;
  vec4 value = imageLoad(color, at);
  // Marched beyond the pixel's surface: what lies behind that is hidden.
  if (scene > surface && !(marched && match > 0.5) && imageLoad(depth, at).r > surface) value = vec4(0.0);
  taps.color += value * (weight * match);
  taps.weight += weight * match;
}

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(pixel, push.targetSize))) return;
  const float surface = min(imageLoad(targetDepth, pixel).r, kFar);
  const vec2 at = (vec2(pixel) + 0.5) * vec2(push.size) / vec2(push.targetSize) - 0.5;
  const ivec2 first = ivec2(floor(at));
  const vec2 f = at - vec2(first);
  Taps taps = Taps(vec4(0.0), 0.0);
  for (int i = 0; i < 4; ++i) {
    const ivec2 corner = ivec2(i & 1, i >> 1);
    const vec2 weight = mix(1.0 - f, f, vec2(corner));
    addTap(first + corner, surface, weight.x * weight.y, taps);
  }
  // None of the four is of this surface: one farther away may be.
  if (taps.weight < kEnoughMatch) {
    taps = Taps(vec4(0.0), 0.0);
    for (int i = 0; i < 16; ++i) {
      const ivec2 texel = first + ivec2(i & 3, i >> 2) - 1;
      const vec2 weight = 2.0 - abs(vec2(texel) - at);
      addTap(texel, surface, weight.x * weight.y, taps);
    }
  }
  const vec4 picture = taps.color / max(taps.weight, 1e-37);
  const vec4 behind = imageLoad(target, pixel);
  imageStore(target, pixel, picture + (1.0 - picture.a) * behind);
}
