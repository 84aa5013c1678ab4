// Descriptions to the tables of a pack.
#ifndef BILLOW_COMPILER_EFFECT_BAKE_EFFECT_H
#define BILLOW_COMPILER_EFFECT_BAKE_EFFECT_H

#include <span>

#include "billow/format/writer.h"
#include "effect/description.h"

namespace billow::compiler {

// Appends the effects; materials, curves, ramps and maps that are equal are stored once.
void bakeEffects(std::span<const EffectDescription> effects, format::PackTables& tables);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_BAKE_EFFECT_H
