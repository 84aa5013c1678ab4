#include "c_api/convert.h"

#include <cmath>

#include "billow/format/affine.h"
#include "checks.h"

namespace billow::c_api {
namespace {

// The value, unless a check names a field of it.
template <class T>
Outcome<T> checked(T value, const char* bad) {
  if (bad == nullptr) return value;
  return badArgument(std::string(bad) + " is outside of its range");
}

}  // namespace

bool soundTransform(const std::array<double, 12>& matrix) {
  double plain[12];
  std::copy(matrix.begin(), matrix.end(), plain);
  return std::all_of(matrix.begin(), matrix.end(), [](double x) { return std::isfinite(x); }) &&
         format::invertible(plain);
}

Outcome<runtime::View> viewOf(const BillowView* view) {
  return given(view).and_then([](const BillowView& v) {
    const runtime::View value{.eye = arrayOf(v.eye),
                              .right = arrayOf(v.right),
                              .up = arrayOf(v.up),
                              .forward = arrayOf(v.forward),
                              .tanHalfHeight = v.tanHalfHeight};
    return checked(value, runtime::badView(value));
  });
}

Outcome<runtime::Sun> sunOf(const BillowSun* sun) {
  return givenOrDefault(sun).and_then([](const BillowSun& s) {
    const runtime::Sun value{.direction = arrayOf(s.direction), .irradiance = arrayOf(s.irradiance)};
    return checked(value, runtime::badSun(value));
  });
}

Outcome<runtime::Quality> qualityOf(const BillowQuality* quality) {
  return givenOrDefault(quality).and_then([](const BillowQuality& q) -> Outcome<runtime::Quality> {
    const auto filter = enumerator<runtime::Filter>(q.filter, 3, "quality.filter");
    if (!filter) return tl::unexpected(filter.error());
    const auto shadows = enumerator<runtime::Filter>(q.shadows, 3, "quality.shadows");
    if (!shadows) return tl::unexpected(shadows.error());
    const runtime::Quality value{.filter = *filter,
                                 .shadows = *shadows,
                                 .step = q.step,
                                 .shadowStep = q.shadowStep,
                                 .shadowSteps = q.shadowSteps,
                                 .jitter = q.jitter != 0};
    return checked(value, runtime::badQuality(value));
  });
}

Outcome<runtime::Background> backgroundOf(const BillowBackground* background) {
  return givenOrDefault(background).and_then([](const BillowBackground& b) {
    const runtime::Background value{.bottom = arrayOf(b.bottom), .top = arrayOf(b.top), .opacity = b.opacity};
    return checked(value, runtime::badBackground(value));
  });
}

Outcome<runtime::Look> lookOf(const BillowLook* look) {
  return given(look).and_then([](const BillowLook& l) {
    const runtime::Look value{.extinctionScale = l.extinctionScale,
                              .albedo = arrayOf(l.albedo),
                              .anisotropy = l.anisotropy,
                              .emissionScale = l.emissionScale,
                              .temperatureScale = l.temperatureScale,
                              .temperatureOffset = l.temperatureOffset,
                              .referenceKelvin = l.referenceKelvin,
                              .ambient = arrayOf(l.ambient),
                              .scatteringOrders = l.scatteringOrders,
                              .heatMax = l.heatMax,
                              .smokeBegin = l.smokeBegin,
                              .smokeFull = l.smokeFull,
                              .smokeInFire = l.smokeInFire};
    return checked(value, runtime::badLook(value));
  });
}

BillowLook lookOf(const runtime::Look& look) {
  BillowLook value = BILLOW_LOOK_DEFAULT;
  value.extinctionScale = look.extinctionScale;
  copyArray(look.albedo, value.albedo);
  value.anisotropy = look.anisotropy;
  value.emissionScale = look.emissionScale;
  value.temperatureScale = look.temperatureScale;
  value.temperatureOffset = look.temperatureOffset;
  value.referenceKelvin = look.referenceKelvin;
  copyArray(look.ambient, value.ambient);
  value.scatteringOrders = look.scatteringOrders;
  value.heatMax = look.heatMax;
  value.smokeBegin = look.smokeBegin;
  value.smokeFull = look.smokeFull;
  value.smokeInFire = look.smokeInFire;
  return value;
}

Outcome<runtime::Playback> playbackOf(const BillowPlayback* playback) {
  return givenOrDefault(playback).and_then([](const BillowPlayback& p) -> Outcome<runtime::Playback> {
    const auto loop = enumerator<runtime::Loop>(p.loop, 3, "playback.loop");
    if (!loop) return tl::unexpected(loop.error());
    const auto interpolation = enumerator<runtime::Interpolation>(p.interpolation, 3, "playback.interpolation");
    if (!interpolation) return tl::unexpected(interpolation.error());
    const runtime::Playback value{.speed = p.speed, .loop = *loop, .interpolation = *interpolation};
    return checked(value, std::isfinite(p.speed) ? nullptr : "playback.speed");
  });
}

Outcome<runtime::SceneShadow> shadowOf(const BillowShadowMap* map) {
  if (map == nullptr) return runtime::SceneShadow{};
  return given(map).map([](const BillowShadowMap& m) {
    return runtime::SceneShadow{
        .view = m.view, .layout = m.layout, .worldToMap = arrayOf(m.worldToMap), .empty = m.empty};
  });
}

Outcome<runtime::ColorFormat> colorFormatOf(BillowColorFormat format, const char* field) {
  return enumerator<runtime::ColorFormat>(format, 2, field);
}

}  // namespace billow::c_api

extern "C" void billowLookAt(const double eye[3], const double target[3], const double up[3], float fieldOfView,
                             BillowView* view) {
  using namespace billow;
  const runtime::View looked =
      runtime::lookAt({eye[0], eye[1], eye[2]}, {target[0], target[1], target[2]}, {up[0], up[1], up[2]}, fieldOfView);
  BillowView value = BILLOW_VIEW_DEFAULT;
  value.tanHalfHeight = looked.tanHalfHeight;
  c_api::copyArray(looked.eye, value.eye);
  c_api::copyArray(looked.right, value.right);
  c_api::copyArray(looked.up, value.up);
  c_api::copyArray(looked.forward, value.forward);
  c_api::giveBack(value, view);
}
