// Descriptions to the tables of a pack.
#ifndef BILLOW_COMPILER_EFFECT_BAKE_EFFECT_H
#define BILLOW_COMPILER_EFFECT_BAKE_EFFECT_H

#include <array>
#include <span>

#include "billow/format/writer.h"
#include "effect/description.h"

namespace billow::compiler {

// The record's numbers: all of it but what refers to tables or strings.
format::EmitterRecord numbersOf(const EmitterDescription& emitter);

// What a ramp says at a radius and an age, both in [0, 1].
std::array<double, 3> rampColour(std::span<const RampRow> ramp, double radius, double age);

// Appends the effects; materials, curves, ramps and maps that are equal are stored once.
void bakeEffects(std::span<const EffectDescription> effects, format::PackTables& tables);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_BAKE_EFFECT_H
