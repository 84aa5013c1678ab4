// `extract` of an effect: its particles at one time as OpenVDB.
#ifndef BILLOW_COMMAND_EXTRACT_EFFECT_H
#define BILLOW_COMMAND_EXTRACT_EFFECT_H

#include <optional>
#include <string>

#include "billow/format/pack.h"

namespace billow::command {

struct EffectArguments {
  std::string effect;
  std::optional<double> time;
  std::optional<double> voxelSize;
};

// Writes the grids density, color and emission. Throws compiler::Error.
void extractEffect(const format::Pack& pack, const EffectArguments& arguments, const std::string& output);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_EXTRACT_EFFECT_H
