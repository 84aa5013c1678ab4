#include "draw_checks.h"

#include <cmath>

#include "checks.h"
#include "layers.h"

namespace billow::runtime {

tl::unexpected<Error> badArgument(const std::string& what) {
  return failure(ErrorCode::argument, "MetavoxelDraw: " + what + " is outside of its range");
}

Result<void> checkDraw(const MetavoxelDraw& draw, const MetavoxelConfig& config) {
  if (draw.width == 0 || draw.height == 0) return badArgument("width, height");
  if (draw.color == VK_NULL_HANDLE || draw.depth == VK_NULL_HANDLE) return badArgument("color, depth");
  if (!positive(draw.voxelSize)) return badArgument("voxelSize");
  if (!(std::isfinite(draw.step) && draw.step >= kLeastStep)) return badArgument("step");
  for (std::size_t i = 0; i < 3; ++i) {
    if (!std::isfinite(draw.center[i]) || !std::isfinite(draw.anchor[i])) return badArgument("center, anchor");
  }
  if (draw.refill != Refill::always && !config.keepFilled) return badArgument("refill, without keepFilled,");
  for (const float share : draw.lightExtinction) {
    if (!(share >= 0) || !std::isfinite(share)) return badArgument("lightExtinction");
  }
  Look scattering;
  scattering.anisotropy = draw.scattering.anisotropy;
  scattering.ambient = draw.scattering.ambient;
  scattering.scatteringOrders = draw.scattering.orders;
  if (badLook(scattering) != nullptr) return badArgument("scattering");
  if (!(draw.scattering.surroundings >= 0 && draw.scattering.surroundings <= 1)) {
    return badArgument("scattering.surroundings");
  }
  if (draw.scattering.bounces < 1 || draw.scattering.bounces > 8) return badArgument("scattering.bounces");
  for (const char* field : {badView(draw.view), badSun(draw.sun), badBackground(draw.background)}) {
    if (field != nullptr) return badArgument(field);
  }
  if (draw.volumes.size() > config.maxVolumes) return badArgument("volumes: their number");
  if (draw.particles.size() > config.maxParticles) return badArgument("particles: their number");
  for (std::size_t i = 0; i < draw.volumes.size(); ++i) {
    const std::string name = "volumes[" + std::to_string(i) + "].";
    if (const char* field = badLayers(draw.volumes[i].frame, draw.volumes[i].layers)) return badArgument(name + field);
    if (!std::isfinite(draw.volumes[i].velocityScale)) return badArgument(name + "velocityScale");
    if (const char* field = badLook(draw.volumes[i].look)) return badArgument(name + field);
  }
  return {};
}

const char* badParticle(const format::Particle& particle, std::size_t materials, std::size_t maps) {
  if (!(std::isfinite(particle.radius) && particle.radius >= 0)) return "radius";
  for (const float at : particle.center) {
    if (!std::isfinite(at)) return "center";
  }
  if (format::kindIn(particle.kind) >= format::kKindCount) return "kind";
  if (particle.material >= materials) return "material";
  if (particle.map == format::kNoMap) return nullptr;
  return format::firstMapIn(particle.map) >= maps || format::secondMapIn(particle.map) >= maps ? "map" : nullptr;
}

}  // namespace billow::runtime
