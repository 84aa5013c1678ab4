// Effects in a pack: emitters of particles, evaluated at any time without history. spec/effects.md is the standard.
#ifndef BILLOW_FORMAT_EFFECT_H
#define BILLOW_FORMAT_EFFECT_H

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "billow/format/cube_map.h"
#include "billow/format/emitter.h"
#include "billow/format/layout.h"
#include "billow/format/particle.h"
#include "billow/format/surface.h"
#include "billow/format/track.h"

namespace billow::format {

// ---- Limits. A pack or description beyond them is refused.
inline constexpr std::uint32_t kMaxAlive = 65536;                  // particles of an effect at once, by mostAlive()
inline constexpr std::uint32_t kMaxCycleParticles = 1048576;       // born by an emitter in one run of its effect
inline constexpr std::uint32_t kMaxEmitters = 64;                  // of an effect
inline constexpr std::uint32_t kMaxSpans = 128;                    // of an emitter
inline constexpr std::uint32_t kMaxAnimatedMaps = 64;              // of an emitter
inline constexpr std::uint32_t kMaxMaps = 65535;                   // that emitters refer to: Particle.map has 16 bits
inline constexpr float kMinDuration = 0.01f, kMaxDuration = 3600;  // seconds
inline constexpr float kMaxLifetime = 600;                         // seconds
inline constexpr float kMaxMagnitude = 1e6f;                       // of lengths, speeds, colours and values of tables
inline constexpr float kMaxDrag = 1000;                            // a second
inline constexpr float kMaxErosionFrequency = 1024;
inline constexpr double kMaxEffectTime = 1e6;  // seconds

inline constexpr std::uint32_t kEffectLoop = 1;     // EffectRecord.flags: runs again and again
inline constexpr std::uint32_t kEffectPrewarm = 2;  // with kEffectLoop: it has always run

// An effect: emitters that work together. It runs from 0 to `duration`; its particles may live on.
struct EffectRecord {
  StringRef name;
  std::uint32_t firstEmitter;
  std::uint32_t emitterCount;
  std::uint32_t flags;
  std::uint32_t seed;
  float duration;  // seconds
  std::uint32_t reserved[5];
};
static_assert(sizeof(EffectRecord) == 48);

// Particles `first` to first + count - 1 of a run are born in it: the i-th at begin + (end - begin) * (i + u) / count
// seconds, u random in [0, 1). A burst has end = begin.
struct SpawnSpan {
  float begin, end;
  std::uint32_t first;
  std::uint32_t count;
};
static_assert(sizeof(SpawnSpan) == 16);

struct CurveRow {
  float values[kCurveSamples];
};
struct RampTable {
  float values[kRampAges][kRampRadii][4];  // r, g, b, unused
};

struct EffectTables {
  std::vector<EffectRecord> effects;
  std::vector<EmitterRecord> emitters;
  std::vector<SpawnSpan> spans;
  std::vector<GivenParticle> given;
  std::vector<ParticleMaterial> materials;
  std::vector<CurveRow> curves;
  std::vector<RampTable> ramps;
  std::vector<CubeMap> maps;
  std::vector<TrackRecord> tracks;
  std::vector<TrackFrame> trackFrames;
  std::vector<std::byte> trackBytes;
  std::vector<SurfacePoint> surfacePoints;
  // The frames decoded, as an open pack has them; not written. Radii of a frame are as many as points, or none.
  std::vector<std::vector<TrackPoint>> trackPoints;
  std::vector<std::vector<float>> trackRadii;

  bool empty() const { return effects.empty(); }
};

// Bytes of all the tables, on disk as in memory.
std::uint64_t effectBytes(const EffectTables& tables);

// Linear between a row's samples; x is clamped to [0, 1].
float sampleCurve(const CurveRow& row, float x);

// No more particles of the emitter than this are alive at any time. From the spans' and the lifetime's numbers alone,
// so at most two more a span than can be.
std::uint64_t mostAlive(const EmitterRecord& emitter, std::span<const SpawnSpan> spans, float duration, bool loop);
// The same of given particles.
std::uint64_t mostAlive(std::span<const GivenParticle> given, float duration, bool loop);
// Of an emitter of an effect, or of all of them, however their particles are born.
std::uint64_t mostAlive(const EffectTables& tables, const EffectRecord& effect, std::uint32_t emitter);
std::uint64_t mostAlive(const EffectTables& tables, const EffectRecord& effect);

// Particles first to last - 1 of a span: all that may be alive at a time, and a few that are not.
struct Candidates {
  std::uint32_t emitter;  // of the effect
  std::uint32_t span;     // of the emitter; 0 for given particles
  std::int64_t run;       // of the effect, which begins at run * duration
  std::uint32_t first, last;
};
// Those of an effect `time` seconds after its begin, in [0, kMaxEffectTime], else none; by emitter, run and span,
// without empty ones. Uses the tables of effects, emitters, spans and given particles alone. The work is that of spans
// and runs, not of particles.
std::vector<Candidates> candidatesAt(const EffectTables& tables, std::uint32_t effect, double time);

// How a particle sets out.
struct Birth {
  std::uint32_t number;  // in the run
  double time;           // seconds into the run
  double lifetime;       // seconds
  std::array<double, 3> position, velocity;
};
// All of one run of an emitter of the effect, in order of numbers; the first run, or any of an emitter with a track.
std::vector<Birth> birthsOf(const EffectTables& tables, const EffectRecord& effect, std::uint32_t emitter);

// What is alive of an effect `time` seconds after its begin, in [0, kMaxEffectTime], else nothing; by emitter, then in
// order of birth's number. The same bits on every machine. `tables` must keep the rules (those of an open pack do).
std::vector<Particle> particlesAt(const EffectTables& tables, std::uint32_t effect, double time);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_EFFECT_H
