// From linear light to what a screen shows, the same in PNG files and in the viewer. Shared by C++ and GLSL.
#ifndef BILLOW_SHADERS_TONE_H
#define BILLOW_SHADERS_TONE_H

#ifdef __cplusplus
#include <algorithm>
#include <cmath>
#define BILLOW_TONE_FUNCTION inline
namespace billow::tone {
using std::clamp;
using std::floor;
using std::min;
using std::pow;
#else
#define BILLOW_TONE_FUNCTION
#endif

// A fit of the ACES film curve (Narkowicz 2015, "ACES filmic tone mapping curve"); linear in, linear [0, 1] out.
BILLOW_TONE_FUNCTION float filmic(float light) {
  float x = light > 0.0f ? min(light, 1e6f) : 0.0f;  // also of NaN, and no infinity over infinity
  return clamp(x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f), 0.0f, 1.0f);
}

BILLOW_TONE_FUNCTION float srgb(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * pow(linear, 1.0f / 2.4f) - 0.055f;
}

// In [0, 1): hides the bands of a smooth background in 8 bits, the same for every run.
BILLOW_TONE_FUNCTION float dither(float x, float y) {
  float a = 0.06711056f * x + 0.00583715f * y;
  float b = 52.9829189f * (a - floor(a));
  return b - floor(b);
}

// A channel of the pixel (x, y) as a whole number from 0 to 255.
BILLOW_TONE_FUNCTION float shown(float light, float x, float y) {
  return floor(clamp(srgb(filmic(light)) * 255.0f + dither(x, y), 0.0f, 255.0f));
}

#ifdef __cplusplus
}  // namespace billow::tone
#endif

#endif  // BILLOW_SHADERS_TONE_H
