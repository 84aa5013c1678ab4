// What bears particles, and what each of their random numbers is for: what the CPU (effect.h) and the GPU evaluate
// alike. Shared by C++ and GLSL; spec/effects.md is the standard.
#ifndef BILLOW_FORMAT_EMITTER_H
#define BILLOW_FORMAT_EMITTER_H

#include "billow/format/layout.h"

#ifdef __cplusplus
#include <cstdint>
#define BILLOW_E_U32 std::uint32_t
#define BILLOW_E_CONST inline constexpr std::uint32_t
#define BILLOW_E_SIZE(type, bytes) static_assert(sizeof(type) == (bytes), "layout of " #type)
namespace billow::format {
#else
#define BILLOW_E_U32 uint
#define BILLOW_E_CONST const uint
#define BILLOW_E_SIZE(type, bytes)
struct StringRef {
  uint offset;
  uint size;
};
#endif

BILLOW_E_CONST kShapePoint = 0u;
BILLOW_E_CONST kShapeSphere = 1u;
BILLOW_E_CONST kShapeBox = 2u;
BILLOW_E_CONST kShapeMesh = 3u;

BILLOW_E_CONST kEmitterAlign = 1u;        // EmitterRecord.flags: own x axis along the velocity
BILLOW_E_CONST kEmitterRandomStart = 2u;  // rotation begins anywhere
BILLOW_E_CONST kEmitterNormal = 4u;       // with shape mesh: `direction` is the surface's normal

BILLOW_E_CONST kNoTrack = 0xffffffffu;  // EmitterRecord.track: motion in closed form

// What a particle's random numbers are for; never renumber.
BILLOW_E_CONST kDrawBirth = 0u;
BILLOW_E_CONST kDrawLifetime = 1u;
BILLOW_E_CONST kDrawPlace = 2u;      // three in a row
BILLOW_E_CONST kDrawDirection = 5u;  // two: height, turn
BILLOW_E_CONST kDrawSpeed = 7u;
BILLOW_E_CONST kDrawRadius = 8u;
BILLOW_E_CONST kDrawAxis = 9u;  // two
BILLOW_E_CONST kDrawAngle = 11u;
BILLOW_E_CONST kDrawMap = 12u;

// Rows are of CURV, or kNoRow for 1 (position and rotation: 0); three rows are consecutive. Those of a life are read at
// a particle's age / lifetime, those of the position at time / duration.
struct EmitterRecord {
  StringRef name;
  BILLOW_E_U32 firstSpan;
  BILLOW_E_U32 spanCount;
  BILLOW_E_U32 flags;
  BILLOW_E_U32 shape;  // EmitterShape
  float extent[3];     // sphere: radius, share of the radius that is hollow, 0; box, mesh: half sides; point: 0
  float position[3];
  BILLOW_E_U32 positionRow;  // of three, added to `position`
  float inheritance;         // share of the emitter's own velocity that particles begin with
  float lifetime[2];         // seconds, least and most
  float direction[3];        // unit
  float spreadCosine;        // of the half angle around it
  float speed[2];
  float gravity[3];
  float drag;  // 1 / second
  float wind[3];
  BILLOW_E_U32 kind;  // of the particles, below: kKind...
  float radius[2];
  BILLOW_E_U32 radiusRow;
  float proportions[3];  // Particle.shape over the radius
  float extinction;      // 1 / world unit
  BILLOW_E_U32 opacityRow;
  float diffuse[3];
  BILLOW_E_U32 diffuseRow;  // of three
  float emission[3];
  BILLOW_E_U32 emissionRow;  // of three
  float axis[3];             // of rotation, unit; 0 0 0: a random one for each particle
  BILLOW_E_U32 rotationRow;  // turns
  float displacement;
  BILLOW_E_U32 displacementRow;
  BILLOW_E_U32 firstMap;  // kNoMap: none
  BILLOW_E_U32 mapCount;  // several: from one to the next, in a circle
  float mapsPerSecond;
  BILLOW_E_U32 material;
  BILLOW_E_U32 track;       // kNoTrack: motion in closed form, by the numbers above
  BILLOW_E_U32 firstPoint;  // of SURF, with shape mesh, else 0
  BILLOW_E_U32 pointCount;
  BILLOW_E_U32 firstGiven;  // of GIVN
  BILLOW_E_U32 givenCount;  // 0: particles are born in spans
  BILLOW_E_U32 reserved[3];
};
BILLOW_E_SIZE(EmitterRecord, 256);

// A particle that was given when the pack was made, instead of being born in a span. An emitter has either these, in
// order of `time`, or spans; its i-th is number i of its track, in every run.
struct GivenParticle {
  float time;       // of its birth, seconds into the run
  float lifetime;   // seconds
  float age;        // at its birth, of the life over which curves are read: seconds
  float life;       // curves are read at (age + seconds since its birth) / life
  float radius;     // factor of the emitter's
  float colour[3];  // factor of the albedo
  BILLOW_E_U32 id;  // its random numbers come from it
  BILLOW_E_U32 reserved;
};
BILLOW_E_SIZE(GivenParticle, 40);

#ifdef __cplusplus
enum class EmitterShape : std::uint32_t {
  point = kShapePoint,
  sphere = kShapeSphere,
  box = kShapeBox,
  mesh = kShapeMesh
};
inline constexpr std::uint32_t kEmitterShapeCount = 4;
}  // namespace billow::format
#endif

#endif  // BILLOW_FORMAT_EMITTER_H
