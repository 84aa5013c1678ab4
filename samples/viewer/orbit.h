// A camera that turns about a target. No window, so that it can be tested alone.
#ifndef BILLOW_VIEWER_ORBIT_H
#define BILLOW_VIEWER_ORBIT_H

#include <array>

#include "billow/runtime/look.h"
#include "billow/runtime/runtime.h"

namespace billow::viewer {

class OrbitCamera {
 public:
  // From `eye` to `target`, which differ; `up` is 'y' or 'z'; fieldOfView in degrees, vertical.
  OrbitCamera(const std::array<double, 3>& eye, const std::array<double, 3>& target, char up, float fieldOfView);

  // By radians, to the right about the upward axis and upwards; never over the top.
  void turn(double right, double up);
  // By shares of the picture's height at the target: what is there follows the pointer.
  void pan(double right, double up);
  // Each step of the wheel towards the target takes a tenth of the way.
  void zoom(double steps);
  // The box in the middle and all of it in a picture of width over height `aspect`, from the same direction.
  void frame(const runtime::WorldBox& box, double aspect);
  void setFieldOfView(float degrees) { fieldOfView_ = degrees; }

  runtime::View view() const;
  std::array<double, 3> eye() const;
  const std::array<double, 3>& target() const { return target_; }
  float fieldOfView() const { return fieldOfView_; }
  char up() const { return up_; }

 private:
  std::array<double, 3> target_;
  double distance_ = 1;
  double azimuth_ = 0, elevation_ = 0;  // of the eye, seen from the target
  char up_;
  float fieldOfView_;
};

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_ORBIT_H
