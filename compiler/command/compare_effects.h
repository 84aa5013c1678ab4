// A pack's effects held against their descriptions, for `compare`.
#ifndef BILLOW_COMMAND_COMPARE_EFFECTS_H
#define BILLOW_COMMAND_COMPARE_EFFECTS_H

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "effect/measure_effect.h"
#include "stages.h"

namespace billow::command {

// One part of one emitter of an effect, or what is wrong with the effect as a whole.
struct EffectRow : compiler::PartError {
  std::string effect;
};

// Rows in the order of the plan's effects. Throws compiler::Error.
std::vector<EffectRow> compareEffects(const format::Pack& pack, const compiler::Plan& plan);

nlohmann::ordered_json toJson(const EffectRow& row);
void printTable(const std::vector<EffectRow>& rows);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_COMPARE_EFFECTS_H
