// Reading effect descriptions from JSON.
#ifndef BILLOW_COMPILER_EFFECT_READ_H
#define BILLOW_COMPILER_EFFECT_READ_H

#include <filesystem>
#include <string>

#include "effect/description.h"
#include "json/value.h"

namespace billow::compiler {

// Reads *.effect.json. Throws Error: Fault::file where it cannot be read, Fault::input naming the JSON path, the value
// and what was expected, also where more particles would be born or alive than a pack may have.
EffectDescription readEffect(const std::string& path);

// ---- Parts of it, each for one member. Throw json::Error, and Error for other files. `effect` has what stands before
// its emitters. `folder` is that of the
// description, to which paths are relative.
EmitterDescription readEmitter(const json::Value& value, const EffectDescription& effect,
                               const std::filesystem::path& folder);
// Particles from files: fills what is given, the lifetimes and the track's error where one is asked for.
void readParticles(const json::Value& value, const EffectDescription& effect, const std::filesystem::path& folder,
                   EmitterDescription& emitter);
// What a particle is made of: fills what the record, the curves and the material have of it.
void readPrimitive(const json::Value& value, const std::filesystem::path& folder, EmitterDescription& emitter);

// A number, or [[time, number], ...].
Keys readCurve(const json::Value& value, const json::Range& times, const json::Range& values);
// Three numbers, or [[time, [x, y, z]], ...].
Keys readVectorCurve(const json::Value& value, const json::Range& times, const json::Range& values);
// [low, high], or one number for both.
void readSpan(const json::Value& value, const json::Range& range, float (&into)[2]);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_READ_H
