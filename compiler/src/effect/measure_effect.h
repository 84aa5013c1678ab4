// A pack's effect held against its description.
#ifndef BILLOW_COMPILER_EFFECT_MEASURE_EFFECT_H
#define BILLOW_COMPILER_EFFECT_MEASURE_EFFECT_H

#include <optional>
#include <string>
#include <vector>

#include "billow/format/pack.h"
#include "effect/description.h"

namespace billow::compiler {

// How well one part of an emitter is kept, in the part's own unit.
struct PartError {
  std::string emitter;  // "" for the effect itself
  std::string part;     // "numbers", "opacity", "displacement", "track", ...
  double largest = 0;   // magnitude of what the description says
  double rmse = 0;
  double maxError = 0;
  std::optional<double> asked;  // the error that it had to keep
  std::string problem;          // "" where it was measured: else what the pack holds instead

  bool sound() const { return problem.empty(); }
};

// Of each emitter, in order: its numbers, which are kept exactly or not at all; its curves and ramps, as the tables are
// read, against the description at all radii and ages (a ramp's picture as it was sampled); its displacement maps, as
// BC4 gives them back, against the noise or picture; its track, as Draco gives it back, against a new simulation or its
// particles' files: rmse and maxError are distances; their radii likewise, where they change. Throws Error as compiling
// does.
std::vector<PartError> measureEffect(const format::Pack& pack, const format::EffectRecord& effect,
                                     const EffectDescription& description);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_MEASURE_EFFECT_H
