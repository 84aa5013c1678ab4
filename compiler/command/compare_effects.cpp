#include "compare_effects.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "pack_lookup.h"

namespace billow::command {

std::vector<EffectRow> compareEffects(const format::Pack& pack, const compiler::Plan& plan) {
  std::vector<EffectRow> rows;
  for (const compiler::EffectDescription& description : plan.effects) {
    const auto number = findEffect(pack, description.name);
    if (!number) {
      compiler::PartError missing;
      missing.problem = "the pack has no such effect";
      rows.push_back({missing, description.name});
      continue;
    }
    for (const compiler::PartError& part : measureEffect(pack, pack.effects().effects[*number], description)) {
      rows.push_back({part, description.name});
    }
  }
  return rows;
}

nlohmann::ordered_json toJson(const EffectRow& row) {
  nlohmann::ordered_json json;
  json["effect"] = row.effect;
  if (!row.emitter.empty()) json["emitter"] = row.emitter;
  if (!row.part.empty()) json["part"] = row.part;
  if (!row.sound()) {
    json["problem"] = row.problem;
    return json;
  }
  json["largest"] = row.largest;
  json["rmse"] = row.rmse;
  json["maxError"] = row.maxError;
  if (row.asked) json["asked"] = *row.asked;
  return json;
}

void printTable(const std::vector<EffectRow>& rows) {
  fmt::print("{:<40} {:<17} {:>11} {:>11} {:>11} {:>11}\n", "effect", "part", "largest", "RMSE", "max error", "asked");
  for (const EffectRow& row : rows) {
    const std::string name = row.emitter.empty() ? row.effect : row.effect + "/" + row.emitter;
    if (!row.sound()) {
      fmt::print("{:<40} {:<17} {}\n", name, row.part, row.problem);
    } else if (row.part == "numbers") {
      fmt::print("{:<40} {:<17} {:>35}\n", name, row.part, "exact");
    } else {
      fmt::print("{:<40} {:<17} {:>11.4g} {:>11.4g} {:>11.4g} {:>11}\n", name, row.part, row.largest, row.rmse,
                 row.maxError, row.asked ? fmt::format("{:.4g}", *row.asked) : "");
    }
  }
}

}  // namespace billow::command
