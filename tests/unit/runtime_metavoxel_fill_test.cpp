// What particles become in metavoxels: closed forms, and the plain evaluation of format/particle_field.h.
#include <gtest/gtest.h>

#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

// The ray through a pixel, of length 1 along `forward`.
std::array<double, 3> rayThrough(const MetavoxelDraw& draw, std::uint32_t pixel) {
  const double x = ((pixel % draw.width + 0.5) / draw.width * 2 - 1) * double{draw.view.tanHalfHeight};
  const double y = (1 - (pixel / draw.width + 0.5) / draw.height * 2) * double{draw.view.tanHalfHeight};
  std::array<double, 3> ray{};
  for (std::size_t i = 0; i < 3; ++i) {
    ray[i] = double{draw.view.forward[i]} + x * double{draw.view.right[i]} + y * double{draw.view.up[i]};
  }
  return ray;
}

double length(const std::array<double, 3>& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

using MetavoxelFill = MetavoxelTest;

TEST_F(MetavoxelFill, SoftBallTransmitsAsItsClosedForm) {
  MetavoxelDraw draw = smallDraw();
  const std::vector<Particle> particles{ball({0.3f, -0.2f, 0.1f}, 3, 0.4f)};
  draw.particles = particles;
  const headless::Picture picture = renderOnce(smallConfig(), draw);
  double opaque = 0;
  for (std::uint32_t i = 0; i < draw.width * draw.height; ++i) {
    const std::array<double, 3> ray = rayThrough(draw, i);
    double along = 0, apart = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double to = double{particles[0].center[k]} - draw.view.eye[k];
      along += to * ray[k] / length(ray);
      apart += to * to;
    }
    // A chord of half length a: the integral of 1 - r^2 along it is 4 a^3 / 3 R^2.
    const double a = std::sqrt(std::max(9 - (apart - along * along), 0.0));
    const double depth = 0.4 * 4 * a * a * a / 27;
    EXPECT_NEAR(picture.rgba[i * 4 + 3], 1 - std::exp(-depth), 0.004) << "pixel " << i;
    opaque = std::max(opaque, double{picture.rgba[i * 4 + 3]});
  }
  EXPECT_GT(opaque, 0.7);
}

}  // namespace
}  // namespace billow::tests
