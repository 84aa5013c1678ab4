// How gas scatters the sun's light: the phase function, and several orders of scattering.
#ifndef BILLOW_PHASE
#define BILLOW_PHASE

#include "bindings.glsl"

const float kPi = 3.14159265;

// Henyey and Greenstein (1941), normalised over the sphere; cosine between the light's way and the scattered way.
float henyeyGreenstein(float g, float cosine) {
  const float base = 1.0 + g * g - 2.0 * g * cosine;
  return (1.0 - g * g) / (4.0 * kPi * base * sqrt(base));
}

// Share of the sun's irradiance that is scattered towards the eye per unit of scattering, where `transmittance` of it
// arrives. Orders after the first are imitated by Wrenninge's sum (Wrenninge, Kulla, Lundqvist 2013, "Oz: the great and
// volumetric"): each half as strong, half as attenuated and half as directed as the one before.
float scatteredShare(float transmittance, float cosine) {
  float strength = 1.0;
  float sum = 0.0;
  for (int order = 0; order < int(params.sunLight.w); ++order) {
    sum += strength * henyeyGreenstein(params.sun.w * strength, cosine) * pow(transmittance, strength);
    strength *= 0.5;
  }
  return sum;
}

#endif
