#include <cmath>

#include "billow/runtime/runtime.h"

namespace billow::runtime {
namespace {

using Vec = std::array<double, 3>;

Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double length(const Vec& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

Vec unit(const Vec& v) {
  const double size = length(v);
  return size > 0 ? Vec{v[0] / size, v[1] / size, v[2] / size} : Vec{0, 0, -1};
}

std::array<float, 3> toFloat(const Vec& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

}  // namespace

View lookAt(const Vec& eye, const Vec& target, const Vec& upward, float fieldOfView) {
  const Vec forward = unit({target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]});
  Vec right = cross(forward, unit(upward));
  if (length(right) < 1e-6) right = cross(forward, std::abs(forward[0]) < 0.5 ? Vec{1, 0, 0} : Vec{0, 1, 0});
  right = unit(right);
  View view;
  view.eye = eye;
  view.right = toFloat(right);
  view.up = toFloat(cross(right, forward));
  view.forward = toFloat(forward);
  view.tanHalfHeight = std::tan(fieldOfView * 0.5f * 3.14159265f / 180);
  return view;
}

GridChoice chooseGrids(const format::Pack& pack, const format::VolumeRecord& volume) {
  GridChoice choice;
  const auto grids = pack.gridsOf(volume);
  for (std::uint32_t i = static_cast<std::uint32_t>(grids.size()); i-- > 0;) {
    const auto role = static_cast<format::Role>(grids[i].role);
    if (role == format::Role::extinction) choice.extinction = i;
    if (role == format::Role::temperature) choice.temperature = i;
    if (role == format::Role::flames) choice.flames = i;
  }
  const bool any =
      choice.extinction != format::kNone || choice.temperature != format::kNone || choice.flames != format::kNone;
  if (!any && !grids.empty()) choice.extinction = 0;
  return choice;
}

GridChoice withVelocity(const format::Pack& pack, const format::VolumeRecord& volume, GridChoice choice) {
  const auto grids = pack.gridsOf(volume);
  for (std::uint32_t i = static_cast<std::uint32_t>(grids.size()); i-- > 0;) {
    const auto role = static_cast<format::Role>(grids[i].role);
    if (role == format::Role::velocityX) choice.velocityX = i;
    if (role == format::Role::velocityY) choice.velocityY = i;
    if (role == format::Role::velocityZ) choice.velocityZ = i;
  }
  return choice;
}

}  // namespace billow::runtime
