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
    for (const format::Particle& particle : format::particlesAt(tables, effect, duration * (moment + 0.5) / kMoments)) {
      if (!(particle.radius > 0)) continue;
      runtime::WorldBox ball{.empty = false};
      for (std::size_t i = 0; i < 3; ++i) {
        ball.min[i] = double{particle.center[i]} - double{particle.radius};
        ball.max[i] = double{particle.center[i]} + double{particle.radius};
      }
      addBox(ball, box);
    }
  }
  return box;
}

}  // namespace billow::c_api
