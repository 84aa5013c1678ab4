#include "orbit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render_setup.h"

namespace billow::viewer {
namespace {

using Vec = std::array<double, 3>;

// Not quite upright, where the direction of up is lost.
constexpr double kMostElevation = 89.5 / 180 * std::numbers::pi;
constexpr double kLeastDistance = 1e-6, kMostDistance = 1e9;

Vec upward(char up) {
  return up == 'y' ? Vec{0, 1, 0} : Vec{0, 0, 1};
}

}  // namespace

OrbitCamera::OrbitCamera(const Vec& eye, const Vec& target, char up, float fieldOfView)
    : target_(target), up_(up), fieldOfView_(fieldOfView) {
  const Vec away{eye[0] - target[0], eye[1] - target[1], eye[2] - target[2]};
  distance_ = std::sqrt(away[0] * away[0] + away[1] * away[1] + away[2] * away[2]);
  const double height = up == 'y' ? away[1] : away[2];
  azimuth_ = up == 'y' ? std::atan2(away[0], away[2]) : std::atan2(away[0], -away[1]);
  elevation_ = std::asin(std::clamp(height / distance_, -1.0, 1.0));
  turn(0, 0);
}

void OrbitCamera::turn(double right, double up) {
  azimuth_ = std::remainder(azimuth_ + right, 2 * std::numbers::pi);
  elevation_ = std::clamp(elevation_ + up, -kMostElevation, kMostElevation);
}

void OrbitCamera::pan(double right, double up) {
  const runtime::View view = this->view();
  const double height = 2 * distance_ * double{view.tanHalfHeight};
  for (std::size_t i = 0; i < 3; ++i) {
    target_[i] -= (right * double{view.right[i]} + up * double{view.up[i]}) * height;
  }
}

void OrbitCamera::zoom(double steps) {
  distance_ = std::clamp(distance_ * std::pow(0.9, steps), kLeastDistance, kMostDistance);
}

void OrbitCamera::frame(const runtime::WorldBox& box, double aspect) {
  if (box.empty) return;
  for (std::size_t i = 0; i < 3; ++i) target_[i] = (box.min[i] + box.max[i]) / 2;
  distance_ = std::clamp(command::fittingDistance(box, target_, view(), aspect), kLeastDistance, kMostDistance);
}

Vec OrbitCamera::eye() const {
  const double side = std::cos(elevation_) * std::sin(azimuth_) * distance_;
  const double front = std::cos(elevation_) * std::cos(azimuth_) * distance_;
  const double height = std::sin(elevation_) * distance_;
  if (up_ == 'y') return {target_[0] + side, target_[1] + height, target_[2] + front};
  return {target_[0] + side, target_[1] - front, target_[2] + height};
}

runtime::View OrbitCamera::view() const {
  return runtime::lookAt(eye(), target_, upward(up_), fieldOfView_);
}

}  // namespace billow::viewer
