// Particles of an emitter at a time: what particles.cpp of format does, in single precision (spec/effects.md, "A
// particle at a time"). Random numbers have the same bits. Lengths are relative to EmitterRecord.position.
#ifndef BILLOW_EMITTER
#define BILLOW_EMITTER

#include "billow/format/emitter.h"
#include "particle.glsl"

layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Emitters { EmitterRecord items[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Spawns { SpawnJob items[]; };
layout(buffer_reference, std430, buffer_reference_align = 4) readonly buffer GivenParticles { GivenParticle items[]; };

struct Motion {
  vec3 place, velocity;
  float radius;  // factor
};

struct Birth {
  uint number;    // in the run
  float runShare;  // of the effect's duration
  float age;       // seconds since
  Motion motion;
};

vec3 vectorOf(float v[3]) { return vec3(v[0], v[1], v[2]); }

float draw(uint seed, uint what) { return unitOf(hashInteger(seed + what)); }
float between(uint seed, uint what, float range[2]) { return range[0] + (range[1] - range[0]) * draw(seed, what); }
float rowAt(uint row, float x, float absent) { return row == kNoRow ? absent : sampleCurve(row, x); }
vec3 rowsAt(uint row, float x, float absent) {
  if (row == kNoRow) return vec3(absent);
  return vec3(sampleCurve(row, x), sampleCurve(row + 1u, x), sampleCurve(row + 2u, x));
}

// ---- Functions. A device's own sine and power may be off by far more than single precision is.

// Of an angle in turns: its sine and cosine.
vec2 sineCosine(float turns) {
  const float quarters = floor(turns * 4.0 + 0.5);
  const float angle = (turns - quarters * 0.25) * 6.28318530718;  // within an eighth of a turn
  const float square = angle * angle;
  float sine = 1.0, cosine = 1.0;
  for (float n = 8.0; n > 0.0; n -= 2.0) {
    sine = 1.0 - sine * square / (n * (n + 1.0));
    cosine = 1.0 - cosine * square / (n * (n - 1.0));
  }
  sine *= angle;
  const int quarter = int(quarters) & 3;
  const vec2 turned = (quarter & 1) != 0 ? vec2(cosine, -sine) : vec2(sine, cosine);
  return quarter >= 2 ? -turned : turned;
}

float cubeRoot(float x) {
  if (!(x > 0.0)) return 0.0;
  const float root = exp2(log2(x) / 3.0);
  return root - (root - x / (root * root)) / 3.0;
}

// E1 and E2 of spec/effects.md; below a half by their series, where the closed forms cancel.
float series(float x, uint shift) {
  float sum = 1.0;
  for (uint n = 8u; n > 0u; --n) sum = 1.0 - sum * x / float(n + shift);
  return sum;
}
float decayMean(float x) { return x < 0.5 ? series(x, 1u) : (1.0 - exp(-x)) / x; }
float decayMeanSlope(float x) { return x < 0.5 ? series(x, 2u) * 0.5 : (1.0 - decayMean(x)) / x; }

// Uniform over the part of the unit sphere within the cone around the z axis. 1 - z^2 would cancel near the axis.
vec3 coneDirection(float cosine, float a, float b) {
  const float below = a * (1.0 - cosine);
  return vec3(sqrt(max(below * (2.0 - below), 0.0)) * sineCosine(b).yx, 1.0 - below);
}

// The vector in a frame whose z axis is `axis` (Duff et al. 2017).
vec3 around(vec3 axis, vec3 v) {
  const float side = axis.z < 0.0 ? -1.0 : 1.0;
  const float a = -1.0 / (side + axis.z);
  const float b = axis.x * axis.y * a;
  return vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x) * v.x +
         vec3(b, side + axis.y * axis.y * a, -axis.y) * v.y + axis * v.z;
}

vec4 turned(vec3 axis, float turns) {
  const vec2 at = sineCosine(turns * 0.5);
  return vec4(axis * at.x, at.y);
}
vec4 product(vec4 a, vec4 b) {
  return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

// The shortest turn of the x axis to the velocity's direction; none where it is at rest.
vec4 alongVelocity(vec3 velocity) {
  const float size = length(velocity);
  if (!(size > 0.0)) return vec4(0.0, 0.0, 0.0, 1.0);
  const vec3 d = velocity / size;
  const vec4 turn = vec4(0.0, -d.z, d.y, 1.0 + d.x);
  const float norm = length(turn);
  return norm > 1e-6 ? turn / norm : vec4(0.0, 0.0, 1.0, 0.0);  // backward: any half turn
}

// ---- Birth

// On which a particle of a mesh is born: place and normal as surface.h of format has them.
uvec2 surfacePoint(EmitterRecord emitter, uint seed) {
  uint index, rest;
  umulExtended(hashInteger(seed + kDrawPlace) & 0xffffff00u, emitter.pointCount, index, rest);
  return Pairs(meta.surfaces.xy).items[emitter.firstPoint + index];
}

vec3 normalOf(uvec2 point) {
  const vec2 p = unpackSnorm4x8(point.y).zw;
  const float z = 1.0 - abs(p.x) - abs(p.y), fold = max(-z, 0.0);
  return normalize(vec3(p.x + (p.x < 0.0 ? fold : -fold), p.y + (p.y < 0.0 ? fold : -fold), z));
}

// In the shape, relative to its middle. A new shape is a case here.
vec3 placeInShape(EmitterRecord emitter, uint seed) {
  const vec3 u = vec3(draw(seed, kDrawPlace), draw(seed, kDrawPlace + 1u), draw(seed, kDrawPlace + 2u));
  const vec3 extent = vectorOf(emitter.extent);
  if (emitter.shape == kShapeSphere) {
    const float hollow = extent.y * extent.y * extent.y;
    return coneDirection(-1.0, u.x, u.y) * (extent.x * cubeRoot(hollow + (1.0 - hollow) * u.z));
  }
  if (emitter.shape == kShapeMesh) {
    const uvec2 point = surfacePoint(emitter, seed);
    return extent * vec3(unpackSnorm2x16(point.x), unpackSnorm2x16(point.y).x);
  }
  return emitter.shape == kShapeBox ? extent * (2.0 * u - 1.0) : vec3(0.0);
}

// The emitter's own, at a share of its effect's duration.
vec3 ownVelocity(EmitterRecord emitter, float runShare, float samplesPerSecond) {
  if (emitter.positionRow == kNoRow) return vec3(0.0);
  const uint i = uint(clamp(floor(runShare * float(kCurveSamples - 1u)), 0.0, float(kCurveSamples - 2u)));
  Floats curves = Floats(meta.tables.zw);
  vec3 speed;
  for (uint axis = 0u; axis < 3u; ++axis) {
    const uint at = (emitter.positionRow + axis) * kCurveSamples + i;
    speed[axis] = (curves.items[at + 1u] - curves.items[at]) * samplesPerSecond;
  }
  return speed;
}

Motion setOut(EmitterRecord emitter, uint seed, float runShare, float samplesPerSecond) {
  Motion motion;
  motion.radius = 1.0;
  motion.place = rowsAt(emitter.positionRow, runShare, 0.0) + placeInShape(emitter, seed);
  const vec3 cone = coneDirection(emitter.spreadCosine, draw(seed, kDrawDirection), draw(seed, kDrawDirection + 1u));
  const bool outward = (emitter.flags & kEmitterNormal) != 0u;
  const vec3 axis = outward ? normalOf(surfacePoint(emitter, seed)) : vectorOf(emitter.direction);
  motion.velocity = around(axis, cone) * between(seed, kDrawSpeed, emitter.speed) +
                    ownVelocity(emitter, runShare, samplesPerSecond) * emitter.inheritance;
  return motion;
}

// ---- Motion

Motion closedForm(EmitterRecord emitter, Birth birth) {
  const float decayed = emitter.drag * birth.age, mean = decayMean(decayed);
  const vec3 pull = vectorOf(emitter.gravity) + emitter.drag * vectorOf(emitter.wind);
  const vec3 start = birth.motion.velocity;
  const vec3 way = (start * mean + pull * birth.age * decayMeanSlope(decayed)) * birth.age;
  return Motion(birth.motion.place + way, start * exp(-decayed) + pull * birth.age * mean, 1.0);
}

// Where a particle is in a frame of a track, and the factor of its radius there: the points are sorted by number, which
// comes before the place.
bool pointIn(uvec2 frame, uint number, out vec4 placeAndRadius) {
  QuadArray points = QuadArray(meta.emitters.zw);
  uint low = frame.x, high = frame.x + frame.y;
  while (low < high) {
    const uint middle = (low + high) / 2u;
    if (points.items[middle].x < number) {
      low = middle + 1u;
    } else {
      high = middle;
    }
  }
  if (low == frame.x + frame.y) return false;
  const uvec4 point = points.items[low];
  const float radius = meta.radii.z == 0u ? 1.0 : Floats(meta.radii.xy).items[low];
  placeAndRadius = vec4(uintBitsToFloat(point.yzw), radius);
  return point.x == number;
}

// On the straight line between two frames, the first of which may be the birth. Given particles rest before their first
// frame and after their last.
Motion sampled(EmitterRecord emitter, SpawnJob job, Birth birth) {
  vec4 before, after;
  const bool first = pointIn(job.points.xy, birth.number, before), second = pointIn(job.points.zw, birth.number, after);
  const vec4 middle = vec4(vectorOf(emitter.position), 0.0);
  const vec4 from = first ? before - middle : vec4(birth.motion.place, 1.0);
  if (!second) return Motion(from.xyz, vec3(0.0), from.w);
  if (!first && emitter.givenCount != 0u) return Motion(after.xyz - middle.xyz, vec3(0.0), after.w);
  const float gone = first ? job.moments.x : birth.age;
  const float whole = gone + job.moments.y;
  if (!(whole > 0.0)) return Motion(from.xyz, vec3(0.0), from.w);
  const vec4 way = after - middle - from;
  const vec4 at = from + way * (gone / whole);
  return Motion(at.xyz, way.xyz / whole, at.w);
}

// ---- Look

vec4 rotationOf(EmitterRecord emitter, uint seed, float share, vec3 velocity) {
  float turns = rowAt(emitter.rotationRow, share, 0.0);
  if ((emitter.flags & kEmitterRandomStart) != 0u) turns += draw(seed, kDrawAngle);
  if ((emitter.flags & kEmitterAlign) != 0u) {
    return product(alongVelocity(velocity), turned(vec3(1.0, 0.0, 0.0), turns));
  }
  vec3 axis = vectorOf(emitter.axis);
  if (axis == vec3(0.0)) axis = coneDirection(-1.0, draw(seed, kDrawAxis), draw(seed, kDrawAxis + 1u));
  return turned(axis, turns);
}

void fillMaps(EmitterRecord emitter, uint seed, float age, inout Particle particle) {
  particle.kind = emitter.kind;
  particle.map = emitter.firstMap;
  if (emitter.firstMap == kNoMap || emitter.mapCount <= 1u) return;
  const float count = float(emitter.mapCount);
  const float at = draw(seed, kDrawMap) * count + age * emitter.mapsPerSecond;
  const float whole = floor(at);
  const uint index = uint(max(whole - floor(whole / count) * count, 0.0)) % emitter.mapCount;
  particle.kind = kindWithShare(emitter.kind, at - whole);
  particle.map = (emitter.firstMap + index) | (emitter.firstMap + (index + 1u) % emitter.mapCount) << 16;
}

// `factor` is one of the radius, `scale` that of the effect in the world.
void fillLook(EmitterRecord emitter, uint seed, float share, float factor, float scale, inout Particle particle) {
  const float radius = between(seed, kDrawRadius, emitter.radius) * factor * rowAt(emitter.radiusRow, share, 1.0);
  particle.radius = max(radius, 0.0) * scale;
  particle.extinction = emitter.extinction * max(rowAt(emitter.opacityRow, share, 1.0), 0.0) / scale;
  particle.shape = vectorOf(emitter.proportions) * particle.radius;
  particle.diffuse = clamp(vectorOf(emitter.diffuse) * rowsAt(emitter.diffuseRow, share, 1.0), 0.0, 1.0);
  particle.emission = max(vectorOf(emitter.emission) * rowsAt(emitter.emissionRow, share, 1.0), 0.0) / scale;
  particle.displacement = clamp(emitter.displacement * rowAt(emitter.displacementRow, share, 1.0), 0.0, 0.95);
  particle.age = share;
  particle.material = emitter.material;
  particle.seed = seed;
}

Particle particleAt(EmitterRecord emitter, SpawnJob job, uint seed, Motion motion, float age, float share) {
  Particle particle;
  particle.center = job.origin.xyz + job.origin.w * rotated(job.turn, motion.place);
  particle.rotation = product(job.turn, rotationOf(emitter, seed, share, motion.velocity));
  fillLook(emitter, seed, share, motion.radius, job.origin.w, particle);
  fillMaps(emitter, seed, age, particle);
  return particle;
}

// And what is lost to rounding (Knuth).
vec2 exactDifference(float a, float b) {
  precise const float difference = a - b;
  precise const float part = difference - a;
  precise const float rest = (a - (difference - part)) - (b + part);
  return vec2(difference, rest);
}

// Its end is found to the last digit: in a loop all end and begin anew in one moment.
Particle givenParticle(EmitterRecord emitter, SpawnJob job, uint i) {
  GivenParticles rows = GivenParticles(meta.surfaces.zw);
  const uint at = emitter.firstGiven + job.numbers.z;
  const GivenParticle given = rows.items[at + i];
  Birth birth;
  birth.number = job.numbers.z + i;
  const vec2 later = exactDifference(given.time, rows.items[at].time);
  const vec2 age = exactDifference(job.times.x, later.x);
  precise const float rest = age.y + (job.times.y - later.y);
  precise const float left = given.lifetime - age.x - rest;
  birth.age = max(age.x + rest, 0.0);  // the host left out those not yet born
  birth.motion.place = -vectorOf(emitter.position);
  Particle particle;
  particle.radius = 0.0;
  if (!(left > 0.0)) return particle;
  Motion motion = sampled(emitter, job, birth);
  motion.radius *= given.radius;
  const float share = min((given.age + birth.age) / given.life, 1.0);
  particle = particleAt(emitter, job, hashInteger(job.numbers.w + given.id), motion, birth.age, share);
  particle.diffuse *= vectorOf(given.colour);
  return particle;
}

// The job's i-th candidate, relative to the space's centre; its radius is 0 where it is not alive.
Particle particleOf(SpawnJob job, uint i) {
  const EmitterRecord emitter = Emitters(meta.emitters.xy).items[job.numbers.y];
  if (emitter.givenCount != 0u) return givenParticle(emitter, job, i);
  const uint seed = hashInteger(job.numbers.w + job.numbers.z + i);
  const float slot = float(i) + draw(seed, kDrawBirth);
  const float lifetime = between(seed, kDrawLifetime, emitter.lifetime);
  Birth birth;
  birth.number = job.numbers.z + i;
  birth.age = job.times.x - job.times.y * slot;
  birth.runShare = job.times.z + job.times.w * slot;
  Particle particle;
  particle.radius = 0.0;
  if (!(birth.age >= 0.0 && birth.age < lifetime)) return particle;
  birth.motion = setOut(emitter, seed, birth.runShare, job.moments.z);
  Motion motion;
  if (emitter.track == kNoTrack) {
    motion = closedForm(emitter, birth);
  } else {
    motion = sampled(emitter, job, birth);
  }
  return particleAt(emitter, job, seed, motion, birth.age, birth.age / lifetime);
}

#endif
