// One procedural volume primitive at one moment, and what it is made of: what emitters produce, what metavoxels are
// filled from, and what `extract` rasterises. Shared by C++ and GLSL; spec/effects.md is the standard.
//
// A primitive's density at a world point p, in [0, 1], times its extinction, is the extinction that it adds there:
//   q       = inverse(rotation) * (p - center), the point in the primitive's own space
//   s       = share of the way from the middle to the surface, before displacement (below), 0 inside to 1 on it
//   surface = 1 - displacement * (1 - m), m in [0, 1] being the value in direction q of two cube maps, linear between
//             them in the second's share (1 without maps)
//   r       = s / surface; density is 0 where r >= 1
//   density = profile(r) * fade(r) * erosion(q), fade(r) = clamp((1 - r) / softness, 0, 1)
// s by kind, with d = |q| / radius:
//   sphere     d
//   ellipsoid  | q / shape |
//   capsule    distance of q to the segment from -shape to shape, over (radius - |shape|)
//   box        largest of |q_i| / shape_i
#ifndef BILLOW_FORMAT_PARTICLE_H
#define BILLOW_FORMAT_PARTICLE_H

#ifdef __cplusplus
#include <cstdint>
#define BILLOW_P_U32 std::uint32_t
#define BILLOW_P_CONST inline constexpr std::uint32_t
#define BILLOW_P_FUNCTION inline
#define BILLOW_P_VEC3(name) float name[3]
#define BILLOW_P_VEC4(name) float name[4]
#define BILLOW_P_SIZE(type, bytes) static_assert(sizeof(type) == (bytes), "layout of " #type)
namespace billow::format {
#else
#define BILLOW_P_U32 uint
#define BILLOW_P_CONST const uint
#define BILLOW_P_FUNCTION
#define BILLOW_P_VEC3(name) vec3 name
#define BILLOW_P_VEC4(name) vec4 name
#define BILLOW_P_SIZE(type, bytes)
#endif

BILLOW_P_CONST kKindSphere = 0u;
BILLOW_P_CONST kKindEllipsoid = 1u;
BILLOW_P_CONST kKindCapsule = 2u;
BILLOW_P_CONST kKindBox = 3u;
BILLOW_P_CONST kKindCount = 4u;

BILLOW_P_CONST kNoMap = 0xffffffffu;  // Particle.map: not displaced
BILLOW_P_CONST kNoRow = 0xffffffffu;  // of a table

struct Particle {
  BILLOW_P_VEC3(center);    // world
  float radius;             // of the bounding sphere, world units, > 0; 0: the particle is not there
  BILLOW_P_VEC4(rotation);  // unit quaternion x y z w, own space to world
  BILLOW_P_VEC3(shape);     // world units, by kind: radii (ellipsoid), half axis (capsule), half sides (box)
  float displacement;       // share of the surface's distance that the map may take away, in [0, 1)
  BILLOW_P_VEC3(diffuse);   // single-scattering albedo, linear RGB in [0, 1]
  float extinction;         // per world unit where density is 1
  BILLOW_P_VEC3(emission);  // radiance per world unit where density is 1, linear RGB
  float age;                // share of its life, in [0, 1]
  BILLOW_P_U32 kind;        // kKind... in bits 0 to 7; share of the second map, in 2^-24ths, from bit 8 on
  BILLOW_P_U32 map;         // numbers of two cube maps: bits 0 to 15 and 16 to 31; or kNoMap
  BILLOW_P_U32 material;    // ParticleMaterial number
  BILLOW_P_U32 seed;        // of what differs from particle to particle
};
BILLOW_P_SIZE(Particle, 96);

// Particle.kind and Particle.map in their parts.
BILLOW_P_FUNCTION BILLOW_P_U32 kindIn(BILLOW_P_U32 kind) {
  return kind & 0xffu;
}
BILLOW_P_FUNCTION float mapShareIn(BILLOW_P_U32 kind) {
  return float(kind >> 8) * (1.0f / 16777216.0f);
}
BILLOW_P_FUNCTION BILLOW_P_U32 firstMapIn(BILLOW_P_U32 map) {
  return map & 0xffffu;
}
BILLOW_P_FUNCTION BILLOW_P_U32 secondMapIn(BILLOW_P_U32 map) {
  return map >> 16;
}
// Particle.kind of a kind and a share in [0, 1].
BILLOW_P_FUNCTION BILLOW_P_U32 kindWithShare(BILLOW_P_U32 kind, float share) {
  BILLOW_P_U32 units = BILLOW_P_U32(share * 16777216.0f);
  return kind | (units < 0xffffffu ? units : 0xffffffu) << 8;
}

// Curves are rows of kCurveSamples floats over [0, 1], ramps kRampRadii by kRampAges RGBA quadruples (radius fastest),
// both read with linear interpolation between samples at i / (count - 1).
BILLOW_P_CONST kCurveSamples = 64u;
BILLOW_P_CONST kRampRadii = 32u;
BILLOW_P_CONST kRampAges = 16u;

BILLOW_P_CONST kProfileConstant = 0u;  // 1
BILLOW_P_CONST kProfileRadial = 1u;    // 1 - r^2
BILLOW_P_CONST kProfileCurve = 2u;     // the curve `profileRow` at r

struct ParticleMaterial {
  BILLOW_P_U32 profile;
  BILLOW_P_U32 profileRow;
  BILLOW_P_U32 diffuseRamp;   // ramp over r and age that multiplies `diffuse`, or kNoRow
  BILLOW_P_U32 emissionRamp;  // ramp that multiplies `emission`, or kNoRow
  float erosion;              // in [0, 1]: density is multiplied by clamp(1 - erosion + noise, 0, 1), noise in [0, 1]
  float erosionFrequency;     // of the noise, periods a bounding radius
  float occlusion;  // in [0, 1]: diffuse is multiplied by 1 - occlusion * (1 - m): the map as ambient occlusion
  float softness;   // in (0, 1]: share of the radius over which density fades in from the surface
};
BILLOW_P_SIZE(ParticleMaterial, 32);

#ifdef __cplusplus
}  // namespace billow::format
#endif

#endif  // BILLOW_FORMAT_PARTICLE_H
