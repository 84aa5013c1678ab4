#include "render_setup.h"

#include <algorithm>
#include <cmath>

#include "billow/format/look.h"

namespace billow::command {
namespace {

using Vec = std::array<double, 3>;

constexpr double kDegree = 3.14159265358979 / 180;
constexpr double kAzimuth = 32 * kDegree;      // of the camera, from the front towards the right
constexpr double kElevation = 14 * kDegree;    // above the horizon
constexpr double kSunAzimuth = -62 * kDegree;  // from the front towards the left: side light, which shows form
constexpr double kSunElevation = 42 * kDegree;
constexpr double kMargin = 1.06;

double dot(const Vec& a, const std::array<float, 3>& b) {
  return a[0] * double{b[0]} + a[1] * double{b[1]} + a[2] * double{b[2]};
}

// A unit vector by its angle about the upward axis, from the front, and above the horizon.
Vec direction(char up, double azimuth, double elevation) {
  const double side = std::cos(elevation) * std::sin(azimuth);
  const double front = std::cos(elevation) * std::cos(azimuth);
  return up == 'y' ? Vec{side, std::sin(elevation), front} : Vec{side, -front, std::sin(elevation)};
}

Vec upward(char up) {
  return up == 'y' ? Vec{0, 1, 0} : Vec{0, 0, 1};
}

runtime::View chooseView(const RenderRequest& request, const runtime::WorldBox& box, char up) {
  const CameraRequest& camera = request.camera;
  if (camera.eye) return runtime::lookAt(*camera.eye, *camera.target, upward(up), camera.fieldOfView);
  const Vec towards = direction(up, kAzimuth, kElevation);
  Vec center{0, 0, 0};
  for (std::size_t i = 0; i < 3; ++i) center[i] = (box.min[i] + box.max[i]) / 2;
  const auto from = [&](double distance) {
    return Vec{center[0] + towards[0] * distance, center[1] + towards[1] * distance, center[2] + towards[2] * distance};
  };
  const runtime::View trial = runtime::lookAt(from(1), center, upward(up), camera.fieldOfView);
  const double distance = fittingDistance(box, center, trial, double{1} * request.width / request.height);
  return runtime::lookAt(from(std::max(distance, 1e-6)), center, upward(up), camera.fieldOfView);
}

runtime::Sun chooseSun(const RenderRequest& request, char up, bool burning) {
  const SunChoice choice = sunOf(request, up, burning);
  runtime::Sun sun;
  sun.direction = choice.direction;
  sun.irradiance = {choice.color[0] * choice.intensity, choice.color[1] * choice.intensity,
                    choice.color[2] * choice.intensity};
  return sun;
}

runtime::Background chooseBackground(const RenderRequest& request, bool burning, bool opaque) {
  runtime::Background background;
  const BackgroundRequest& wanted = request.background;
  if (wanted.kind == BackgroundRequest::Kind::none) return background;
  if (wanted.kind == BackgroundRequest::Kind::colors) return {wanted.bottom, wanted.top, 1};
  if (!opaque) return background;
  background.opacity = 1;
  background.bottom = burning ? Triple{0.040f, 0.036f, 0.036f} : Triple{0.30f, 0.36f, 0.42f};
  background.top = burning ? Triple{0.010f, 0.012f, 0.018f} : Triple{0.07f, 0.13f, 0.24f};
  return background;
}

// A scale times a factor, finite.
float scaled(float scale, double factor) {
  return static_cast<float>(std::min(double{scale} * factor, double{format::kLargestLook}));
}

// `ambientGiven`: by the pack.
runtime::Look chooseLook(const LookRequest& wanted, runtime::Look look, bool burning, bool ambientGiven) {
  if (!ambientGiven) look.ambient = burning ? Triple{0.05f, 0.06f, 0.08f} : Triple{0.07f, 0.10f, 0.14f};
  runtime::applyLook(wanted.record, look);
  look.extinctionScale = scaled(look.extinctionScale, double{wanted.density});
  look.emissionScale = scaled(look.emissionScale, double{wanted.fire});
  look.scatteringOrders = wanted.scatteringOrders.value_or(look.scatteringOrders);
  return look;
}

}  // namespace

double fittingDistance(const runtime::WorldBox& box, const Vec& center, const runtime::View& view, double aspect) {
  const double tanY = double{view.tanHalfHeight} / kMargin;
  double distance = 0;
  for (int place = 0; place < 27; ++place) {
    const int sides[3] = {place / 9 - 1, place / 3 % 3 - 1, place % 3 - 1};
    const double reach = sides[0] * sides[1] * sides[2] != 0 ? 1 / kMargin : 1;
    Vec at;
    for (std::size_t i = 0; i < 3; ++i) at[i] = sides[i] * (box.max[i] - center[i]) * reach;
    const double across = std::max(std::abs(dot(at, view.right)) / (tanY * aspect), std::abs(dot(at, view.up)) / tanY);
    distance = std::max(distance, across - dot(at, view.forward));
  }
  return distance;
}

SunChoice sunOf(const RenderRequest& request, char up, bool burning) {
  const Vec towards = direction(up, kSunAzimuth, kSunElevation);
  const Triple direction{static_cast<float>(towards[0]), static_cast<float>(towards[1]),
                         static_cast<float>(towards[2])};
  return {.direction = request.sunDirection.value_or(direction),
          .color = request.sunColor.value_or(Triple{1.0f, 0.93f, 0.82f}),
          // Beside a fire the sun is a dim one, so that the fire is what lights the picture.
          .intensity = request.sunIntensity.value_or(burning ? 3.2f : 8.5f)};
}

runtime::Look lookOf(const RenderRequest& request, const VolumeRequest& volume, const runtime::Look& suggested,
                     double scale) {
  runtime::Look look = chooseLook(request.look, suggested, false, true);
  runtime::applyLook(volume.look.record, look);
  look.extinctionScale = scaled(look.extinctionScale, double{volume.look.density} / scale);
  look.emissionScale = scaled(look.emissionScale, double{volume.look.fire} / scale);
  return look;
}

char risingAxis(const format::Pack& pack, const format::VolumeRecord& volume, const runtime::GridChoice& grids) {
  runtime::WorldBox first, last;
  for (std::uint32_t frame = 0; frame < volume.frameCount; ++frame) {
    const runtime::WorldBox box = runtime::worldBox(pack, volume, grids, frame, frame);
    if (box.empty) continue;
    if (first.empty) first = box;
    last = box;
  }
  // Gas that rises grows at the top while its source stays.
  const auto rise = [&](std::size_t axis) {
    return (last.max[axis] - first.max[axis]) - std::abs(last.min[axis] - first.min[axis]);
  };
  const double size = last.max[1] - last.min[1];
  return rise(1) > rise(2) + 0.1 * size && rise(1) > 0 ? 'y' : 'z';
}

Stage stageOf(const format::Pack& pack, const format::VolumeRecord& volume, const runtime::GridChoice& grids,
              const runtime::Look& suggested, std::uint32_t first, std::uint32_t last) {
  return {.box = runtime::worldBox(pack, volume, grids, first, last),
          .up = risingAxis(pack, volume, grids),
          .burning = suggested.emissionScale > 0,
          .ambientGiven = format::isSet(volume.look, format::kLookAmbient)};
}

runtime::DrawInfo setUp(const RenderRequest& request, const format::Pack& pack, const format::VolumeRecord& volume,
                        const runtime::GridChoice& grids, const runtime::Look& suggested, std::uint32_t first,
                        std::uint32_t last, bool opaque) {
  return setUp(request, stageOf(pack, volume, grids, suggested, first, last), suggested, opaque);
}

runtime::DrawInfo setUp(const RenderRequest& request, const Stage& stage, const runtime::Look& suggested, bool opaque) {
  const char up = request.up.value_or(stage.up);
  runtime::DrawInfo draw;
  draw.width = request.width;
  draw.height = request.height;
  draw.colorFormat = runtime::ColorFormat::single;
  draw.view = chooseView(request, stage.box, up);
  const bool burning = stage.burning && request.look.fire > 0;
  draw.look = chooseLook(request.look, suggested, burning, stage.ambientGiven);
  draw.sun = chooseSun(request, up, burning);
  draw.background = chooseBackground(request, burning, opaque);
  draw.quality.filter = request.filter;
  draw.quality.shadows = request.shadows;
  draw.quality.step = request.step;
  draw.quality.jitter = false;
  return draw;
}

}  // namespace billow::command
