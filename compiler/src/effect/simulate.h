// Motion without a closed form: small steps, kept as tracks.
#ifndef BILLOW_COMPILER_EFFECT_SIMULATE_H
#define BILLOW_COMPILER_EFFECT_SIMULATE_H

#include <span>
#include <vector>

#include "billow/format/effect.h"
#include "effect/description.h"

namespace billow::compiler {

// Where the particles of one run are in each frame: those that are alive then, or die in the frame time before.
// `where` names the emitter in messages. Throws Error(Fault::input) where a pack cannot hold as many.
TrackPoints simulate(std::span<const format::Birth> births, const EmitterDescription& emitter,
                     const std::string& where);

struct TrackSource {
  const TrackPoints& points;
  std::span<const std::vector<float>> radii;  // by frame, one a point; empty: none
  float framesPerSecond;
  double error;        // world units, by which no point is off
  double radiusError;  // by which no radius is
};

// Appends the track to the tables and returns its number. Throws Error(Fault::input) where the error is too small for
// the distances.
std::uint32_t addTrack(const TrackSource& source, const std::string& where, format::EffectTables& tables);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_SIMULATE_H
