#include "render_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "billow/format/look.h"
#include "command.h"

namespace billow::command {

char upOf(const Contents& contents) {
  if (contents.volumes().empty()) return 'y';
  const PlacedVolume& volume = contents.volumes().front();
  const std::size_t axis = risingAxis(*volume.pack, volume.record(), volume.grids) == 'y' ? 1 : 2;
  const Matrix& m = volume.request->transform;
  const double y = std::abs(m[4 + axis]), z = std::abs(m[8 + axis]);
  return y > z || (y == z && axis == 1) ? 'y' : 'z';
}

Checked<Stage> stageOf(const Contents& contents, std::span<const double> times, SpaceNeeds& needs) {
  Stage stage{.box = {}, .up = upOf(contents), .burning = false, .ambientGiven = false};
  for (const PlacedVolume& volume : contents.volumes()) {
    runtime::addBox(volume.box(), stage.box);
    stage.burning = stage.burning || volume.suggested.emissionScale * volume.request->look.fire > 0;
    stage.ambientGiven = stage.ambientGiven || format::isSet(volume.record().look, format::kLookAmbient);
  }
  needs.lattice = contents.finestVoxels();
  needs.volumes = static_cast<std::uint32_t>(contents.volumes().size());
  for (const double time : times) {
    const Particles particles = contents.particlesAt(time);
    runtime::addParticles(particles, stage.box);
    needs.particles = std::max(needs.particles, contents.mostParticles(time));
    if (!contents.volumes().empty()) continue;
    for (const format::Particle& particle : particles) {
      for (const float channel : particle.emission) stage.burning = stage.burning || channel > 0;
    }
  }
  needs.box = stage.box;
  if (needs.particles <= kMostParticles) return stage;
  return tl::unexpected(
      Refusal{kInvalid, fmt::format("{} particles may be alive at once; expected at most {} of all effects together",
                                    needs.particles, kMostParticles)});
}

runtime::Look suggestedLook(const Contents& contents) {
  if (!contents.volumes().empty()) return contents.volumes().front().suggested;
  runtime::Look look;
  look.scatteringOrders = 4;
  return look;
}

runtime::MetavoxelVolume placed(const RenderRequest& request, const PlacedVolume& volume,
                                std::span<const runtime::Layer> layers, const runtime::Look& shared) {
  runtime::MetavoxelVolume placed{
      .layers = layers, .velocityScale = request.velocityScale, .objectToWorld = volume.request->transform};
  placed.look = lookOf(request, *volume.request, volume.suggested, volume.scale());
  placed.look.ambient = shared.ambient;
  placed.look.anisotropy = shared.anisotropy;
  placed.look.scatteringOrders = shared.scatteringOrders;
  return placed;
}

}  // namespace billow::command
