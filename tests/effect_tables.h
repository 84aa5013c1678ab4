// A small effect for tests, sound as it stands.
#ifndef BILLOW_TESTS_EFFECT_TABLES_H
#define BILLOW_TESTS_EFFECT_TABLES_H

#include <algorithm>

#include "billow/format/effect.h"
#include "billow/format/writer.h"

namespace billow::tests {

inline format::EmitterRecord plainEmitter() {
  using namespace format;
  EmitterRecord emitter{};
  emitter.spanCount = 1;
  emitter.positionRow = emitter.radiusRow = emitter.opacityRow = emitter.diffuseRow = emitter.emissionRow = kNoRow;
  emitter.rotationRow = emitter.displacementRow = kNoRow;
  emitter.firstMap = kNoMap;
  emitter.track = kNoTrack;
  emitter.lifetime[0] = emitter.lifetime[1] = 2;
  emitter.direction[1] = 1;
  emitter.spreadCosine = 1;
  emitter.radius[0] = emitter.radius[1] = 1;
  emitter.extinction = 1;
  std::fill_n(emitter.diffuse, 3, 0.5f);
  return emitter;
}

// One effect of 4 s with one emitter of 40 particles, evenly over its time.
inline format::EffectTables plainEffect() {
  using namespace format;
  EffectTables tables;
  EffectRecord effect{};
  effect.emitterCount = 1;
  effect.seed = 7;
  effect.duration = 4;
  tables.effects.push_back(effect);
  tables.emitters.push_back(plainEmitter());
  tables.spans.push_back({0, 4, 0, 40});
  tables.materials.push_back({kProfileConstant, kNoRow, kNoRow, kNoRow, 0, 1, 0, 0.001f});
  return tables;
}

// Gives every record a name of its own in the tables' strings and hands the effects over.
inline format::PackTables packTables(format::EffectTables effects) {
  format::PackTables tables;
  for (std::size_t i = 0; i < effects.effects.size(); ++i) {
    effects.effects[i].name = tables.addString("effect " + std::to_string(i));
  }
  for (std::size_t i = 0; i < effects.emitters.size(); ++i) {
    effects.emitters[i].name = tables.addString("emitter " + std::to_string(i));
  }
  tables.effects = std::move(effects);
  return tables;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_EFFECT_TABLES_H
