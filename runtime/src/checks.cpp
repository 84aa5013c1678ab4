#include "checks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace billow::runtime {
namespace {

// Whether low <= each <= high; a NaN is not.
bool within(const std::array<float, 3>& v, float low, float high) {
  return std::all_of(v.begin(), v.end(), [&](float value) { return value >= low && value <= high; });
}

}  // namespace

bool finite(const std::array<float, 3>& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

bool positive(float value) {
  return std::isfinite(value) && value > 0;
}

const char* badView(const View& view) {
  if (!std::all_of(view.eye.begin(), view.eye.end(), [](double at) { return std::isfinite(at); })) return "view.eye";
  if (!finite(view.right) || !finite(view.up) || !finite(view.forward)) return "view.right, up, forward";
  return positive(view.tanHalfHeight) ? nullptr : "view.tanHalfHeight";
}

const char* badSun(const Sun& sun) {
  if (!finite(sun.direction) || sun.direction == std::array<float, 3>{0, 0, 0}) return "sun.direction";
  return within(sun.irradiance, 0, std::numeric_limits<float>::max()) ? nullptr : "sun.irradiance";
}

const char* badBackground(const Background& background) {
  if (!finite(background.bottom) || !finite(background.top)) return "background.bottom, top";
  return background.opacity >= 0 && background.opacity <= 1 ? nullptr : "background.opacity";
}

const char* badLook(const Look& look) {
  if (!within(look.albedo, 0, 1)) return "look.albedo";
  if (!(std::abs(look.anisotropy) < 1)) return "look.anisotropy";
  if (!finite(look.ambient)) return "look.ambient";
  if (look.scatteringOrders < 1 || look.scatteringOrders > 8) return "look.scatteringOrders";
  if (!positive(look.heatMax)) return "look.heatMax";
  return positive(look.referenceKelvin) ? nullptr : "look.referenceKelvin";
}

const char* badQuality(const Quality& quality) {
  const auto step = [](float voxels) { return std::isfinite(voxels) && voxels >= kLeastStep; };
  if (!step(quality.step)) return "quality.step";
  if (!step(quality.shadowStep) || quality.shadowSteps == 0) return "quality.shadowStep, shadowSteps";
  return quality.filter == Filter::none ? "quality.filter" : nullptr;
}

}  // namespace billow::runtime
