// Effects of several packs in one set of tables, as a scene draws them.
#ifndef BILLOW_FORMAT_GATHER_EFFECTS_H
#define BILLOW_FORMAT_GATHER_EFFECTS_H

#include <array>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>

#include "billow/format/effect.h"

namespace billow::format {

// Holds what its effects use, and nothing that only others of their packs do. What effects of one pack share stays
// shared.
class GatheredEffects {
 public:
  // Takes an effect over, once however often it is asked for, and returns its number in tables(). `source` must keep
  // the rules (those of an open pack do), and live and stay where it is as long as effects are added. `density` and
  // `fire`, finite and not below 0, are factors on its extinction and emission, which stay within the rules.
  std::uint32_t add(const EffectTables& source, std::uint32_t effect, float density = 1, float fire = 1);

  // Without names: those lie in the packs' strings.
  const EffectTables& tables() const { return tables_; }

 private:
  // `count` records from `first` of one of a source's tables, and where they stand now.
  using Places = std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>;
  struct Moved {
    std::map<std::tuple<std::uint32_t, float, float>, std::uint32_t> effects;
    Places materials, curves, ramps, maps, surfacePoints, tracks;
  };

  EmitterRecord moveEmitter(const EffectTables& source, Moved& moved, const EmitterRecord& emitter);
  std::uint32_t addMaterial(const EffectTables& source, Moved& moved, std::uint32_t number);
  std::uint32_t addTrack(const EffectTables& source, Moved& moved, std::uint32_t number);

  EffectTables tables_;
  std::map<const EffectTables*, Moved> moved_;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_GATHER_EFFECTS_H
