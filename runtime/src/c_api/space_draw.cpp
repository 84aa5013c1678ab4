#include "c_api/space_draw.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "billow/format/similarity.h"
#include "c_api/convert.h"
#include "c_api/shown.h"

namespace billow::c_api {
namespace {

// Where the space lies, and in which voxels.
struct Place {
  std::array<double, 3> center{0, 0, 0}, anchor{0, 0, 0};
  float voxelSize = 1;
};

double scaleOf(const std::array<double, 12>& m) {
  const double determinant =
      m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
  return std::cbrt(std::abs(determinant));
}

// Around all that is drawn, of its finest voxels, or larger ones where those would not span it.
Place placeAround(const BillowSpace& space, const std::vector<Shown>& shown,
                  const std::vector<runtime::MetavoxelEffect>& effects) {
  runtime::WorldBox box;
  Place place;
  double finest = 0;
  for (const Shown& one : shown) {
    const std::array<double, 12>& m = one.instance->info.objectToWorld;
    runtime::addBox(transformed(one.facts->box, m), box);
    const double edge = one.facts->voxelSize * scaleOf(m);
    if (!(edge > 0) || (finest > 0 && finest <= edge)) continue;
    finest = edge;
    const std::array<double, 3>& at = one.facts->anchor;
    for (std::size_t i = 0; i < 3; ++i) {
      place.anchor[i] = m[i * 4] * at[0] + m[i * 4 + 1] * at[1] + m[i * 4 + 2] * at[2] + m[i * 4 + 3];
    }
  }
  for (const runtime::MetavoxelEffect& effect : effects) {
    runtime::addBox(transformed(space.effectBoxes[effect.effect], effect.objectToWorld), box);
  }
  double squared = 0;
  for (std::size_t i = 0; i < 3 && !box.empty; ++i) {
    const double edge = box.max[i] - box.min[i];
    squared += edge * edge;
    place.center[i] = (box.min[i] + box.max[i]) / 2;
  }
  // One metavoxel is kept for the half voxel by which the space may move, and for filtering at its faces.
  const std::uint32_t across = std::max(space.config.metavoxels, 2u) - 1;
  const double least = std::sqrt(squared) / (double{1} * across * (space.config.edge - 2));
  const double voxel = std::max(finest, least);
  if (voxel > 0) place.voxelSize = static_cast<float>(voxel);
  return place;
}

// The instance's size in the picture, times its priority: what billow loads by.
double importanceOf(const Shown& one, const std::array<double, 3>& eye) {
  const runtime::WorldBox box = transformed(one.facts->box, one.instance->info.objectToWorld);
  double size = 0, distance = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    size += (box.max[i] - box.min[i]) * (box.max[i] - box.min[i]);
    const double way = std::max({box.min[i] - eye[i], eye[i] - box.max[i], 0.0});
    distance += way * way;
  }
  // From within it is as large as the picture, whatever its size.
  return double{one.instance->info.priority} * (size > 0 ? std::sqrt(size / std::max(distance, size * 1e-6)) : 0);
}

// The most important ones, where there are more than `most`; they stay in their order.
void keepLargest(const std::array<double, 3>& eye, std::uint32_t most, std::vector<Shown>& shown) {
  if (shown.size() <= most) return;
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < shown.size(); ++i) order.emplace_back(-importanceOf(shown[i], eye), i);
  std::sort(order.begin(), order.end());
  order.resize(most);
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<Shown> kept;
  for (const auto& [importance, i] : order) kept.push_back(shown[i]);
  shown = std::move(kept);
}

Outcome<std::vector<runtime::MetavoxelEffect>> effectsOf(const BillowSpace& space, const BillowDrawInfo& draw) {
  std::vector<runtime::MetavoxelEffect> all;
  for (std::uint32_t i = 0; i < draw.effectCount; ++i) {
    const auto effect = givenAt(draw.effects, i);
    if (!effect) return tl::unexpected(effect.error());
    const auto numbers = space.effectNumbers.find(effect->pack.id);
    if (numbers == space.effectNumbers.end() || effect->effect >= numbers->second.size()) {
      return badArgument("the space has no effect " + std::to_string(effect->effect) + " of pack " +
                         std::to_string(effect->pack.id));
    }
    const std::array<double, 12> transform = arrayOf(effect->objectToWorld);
    if (!std::isfinite(effect->time) || !format::similarityOf(transform)) {
      return badArgument("BillowEffect: time or objectToWorld is outside of its range");
    }
    all.push_back({.effect = numbers->second[effect->effect], .time = effect->time, .objectToWorld = transform});
  }
  return all;
}

Outcome<runtime::Scattering> scatteringOf(const BillowDrawInfo& draw, const std::vector<Shown>& shown) {
  if (draw.scattering == nullptr) {
    runtime::Scattering scattering;
    if (shown.empty()) return scattering;
    const runtime::Look& look = shown.front().look;
    scattering.anisotropy = look.anisotropy;
    scattering.ambient = look.ambient;
    scattering.orders = look.scatteringOrders;
    return scattering;
  }
  return given(draw.scattering).map([](const BillowScattering& s) {
    return runtime::Scattering{.anisotropy = s.anisotropy,
                               .ambient = arrayOf(s.ambient),
                               .orders = s.orders,
                               .surroundings = s.surroundings,
                               .bounces = s.bounces};
  });
}

Outcome<void> addMethods(const BillowDrawInfo& draw, runtime::MetavoxelDraw& into) {
  const auto attenuation = enumerator<runtime::Attenuation>(draw.attenuation, 2, "BillowDrawInfo::attenuation");
  if (!attenuation) return tl::unexpected(attenuation.error());
  const auto blend = enumerator<runtime::Blend>(draw.blend, 2, "BillowDrawInfo::blend");
  if (!blend) return tl::unexpected(blend.error());
  const auto refill = enumerator<runtime::Refill>(draw.refill, 3, "BillowDrawInfo::refill");
  if (!refill) return tl::unexpected(refill.error());
  into.attenuation = *attenuation;
  into.blend = *blend;
  into.refill = *refill;
  into.lightExtinction = arrayOf(draw.lightExtinction);
  into.cull = draw.noCull == 0;
  return {};
}

Outcome<runtime::MetavoxelDraw> drawOf(const BillowDrawInfo& draw, const std::vector<Shown>& shown,
                                       const Place& place) {
  const auto seen = seenOf(draw);
  if (!seen) return tl::unexpected(seen.error());
  const auto scattering = scatteringOf(draw, shown);
  if (!scattering) return tl::unexpected(scattering.error());
  const auto sceneShadow = shadowOf(draw.shadowMap);
  if (!sceneShadow) return tl::unexpected(sceneShadow.error());
  runtime::MetavoxelDraw info{.view = seen->view,
                              .sun = seen->sun,
                              .scattering = *scattering,
                              .center = place.center,
                              .anchor = place.anchor,
                              .voxelSize = place.voxelSize,
                              .step = seen->quality.step,
                              .jitter = seen->quality.jitter,
                              .background = seen->background,
                              .width = draw.width,
                              .height = draw.height,
                              .colorFormat = seen->colorFormat,
                              .color = draw.color,
                              .depth = draw.depth,
                              .sceneDepth = draw.sceneDepth,
                              .sceneShadow = *sceneShadow,
                              .timestamps = draw.timestamps,
                              .firstTimestamp = draw.firstTimestamp};
  if (auto added = addMethods(draw, info); !added) return tl::unexpected(added.error());
  return info;
}

}  // namespace

Outcome<void> drawInSpace(BillowSpace& space, VkCommandBuffer commands, const BillowDrawInfo& draw) {
  auto shown = shownBy(*space.context, draw);
  if (!shown) return tl::unexpected(shown.error());
  if (draw.instances == nullptr) {
    const auto view = viewOf(draw.view);
    if (!view) return tl::unexpected(view.error());
    keepLargest(view->eye, space.config.maxVolumes, *shown);
  }
  if (shown->size() > space.config.maxVolumes) {
    return badArgument("BillowDrawInfo: " + std::to_string(shown->size()) + " instances; the space takes " +
                       std::to_string(space.config.maxVolumes));
  }
  const auto effects = effectsOf(space, draw);
  if (!effects) return tl::unexpected(effects.error());
  const Place place = draw.voxelSize != 0 ? Place{arrayOf(draw.center), arrayOf(draw.anchor), draw.voxelSize}
                                          : placeAround(space, *shown, *effects);
  std::vector<runtime::MetavoxelVolume> volumes;
  for (const Shown& one : *shown) {
    volumes.push_back({.layers = std::span(one.drawable.layers).first(one.drawable.count),
                       .objectToWorld = one.instance->info.objectToWorld,
                       .look = one.look});
  }
  auto info = drawOf(draw, *shown, place);
  if (!info) return tl::unexpected(info.error());
  info->volumes = volumes;
  info->effects = *effects;
  const auto recorded = space.metavoxels->record(commands, *info);
  if (!recorded) return problem(recorded.error());
  return {};
}

}  // namespace billow::c_api
