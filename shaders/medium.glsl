// What a grid value means optically: extinction and emission.
#ifndef BILLOW_MEDIUM
#define BILLOW_MEDIUM

#include "skip.glsl"

// The grid that extinction comes from: its own, or where there is none the temperature, or the flames.
uint extinctionSlot() {
  if (hasGrid(kExtinctionSlot)) return kExtinctionSlot;
  return hasGrid(kTemperatureSlot) ? kTemperatureSlot : kFlamesSlot;
}

// Extinction per world unit. Without a density grid smoke is where gas has cooled: it rises with the first warmth and
// thins out where it is hottest, so that the fire shows.
float extinctionOf(float value) {
  if (hasGrid(kExtinctionSlot)) return max(value, 0.0) * params.ambient.w;
  const float warmth = max(value, 0.0) * params.smoke.x;
  const float rise = smoothstep(params.smoke.y, params.smoke.z, warmth);
  return params.ambient.w * rise * mix(1.0, params.smoke.w, smoothstep(params.smoke.z, 1.0, warmth));
}

// Colour of a black body by Planck's law at 610, 550 and 465 nm against 6500 K, of luminance 1, times the
// Stefan-Boltzmann power against the reference temperature.
vec3 blackbody(float kelvin) {
  const vec3 secondRadiation = vec3(0.0143878 / 610e-9, 0.0143878 / 550e-9, 0.0143878 / 465e-9);
  const vec3 white = exp(secondRadiation / 6500.0) - 1.0;
  const float safe = max(kelvin, 500.0);
  const vec3 x = secondRadiation / safe;
  // exp(x.r - x) keeps the ratios where exp(-x) alone would underflow.
  const vec3 power = white * exp(x.r - x) / (1.0 - exp(-x));
  const float ratio = max(kelvin, 0.0) / params.emission.w;
  return power / dot(power, vec3(0.2126, 0.7152, 0.0722)) * (ratio * ratio * ratio * ratio);
}

// Radiance per world unit that the burning gas gives off.
vec3 emissionOf(float temperature, float flames) {
  if (params.emission.x == 0.0) return vec3(0.0);
  const bool burning = hasGrid(kFlamesSlot);
  const float heat = hasGrid(kTemperatureSlot) ? temperature : flames;
  const float amount = burning ? flames : temperature * params.smoke.x;
  if (amount <= 0.0) return vec3(0.0);
  return params.emission.x * amount * blackbody(params.emission.z + params.emission.y * heat);
}

#endif
