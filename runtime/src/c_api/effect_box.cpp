#include "c_api/effect_box.h"

#include "c_api/volume_facts.h"

namespace billow::c_api {
namespace {

constexpr int kMoments = 16;

}  // namespace

runtime::WorldBox effectBox(const format::EffectTables& tables, std::uint32_t effect) {
  runtime::WorldBox box;
  const double duration = double{tables.effects[effect].duration};
  for (int moment = 0; moment < kMoments; ++moment) {
    runtime::addParticles(format::particlesAt(tables, effect, duration * (moment + 0.5) / kMoments), box);
  }
  return box;
}

}  // namespace billow::c_api
