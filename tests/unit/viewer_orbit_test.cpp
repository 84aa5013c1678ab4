// The viewer's camera: what turning, moving, zooming and framing do to the view.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "orbit.h"

namespace billow::viewer {
namespace {

using Vec = std::array<double, 3>;

double distance(const Vec& a, const Vec& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Where a point lies in the picture: right and up from its middle, in halves of its height; and how far away.
Vec project(const runtime::View& view, const Vec& point) {
  Vec result{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double away = point[i] - view.eye[i];
    result[0] += away * double{view.right[i]};
    result[1] += away * double{view.up[i]};
    result[2] += away * double{view.forward[i]};
  }
  result[0] /= result[2] * double{view.tanHalfHeight};
  result[1] /= result[2] * double{view.tanHalfHeight};
  return result;
}

TEST(OrbitCamera, BeginsWhereItIsPut) {
  for (const char up : {'y', 'z'}) {
    for (const Vec& eye : {Vec{4, 3, 2}, Vec{-1, 8, -5}, Vec{2, 3, 30}, Vec{2, -20, 3.5}}) {
      const OrbitCamera camera(eye, {1, 2, 3}, up, 40);
      EXPECT_LT(distance(camera.eye(), eye), 1e-9) << up;
      const Vec middle = project(camera.view(), {1, 2, 3});
      EXPECT_NEAR(middle[0], 0, 1e-6);
      EXPECT_NEAR(middle[1], 0, 1e-6);
    }
  }
}

TEST(OrbitCamera, TurnsAboutTheTargetAtItsDistance) {
  OrbitCamera camera({0, 0, 5}, {0, 0, 0}, 'y', 40);
  camera.turn(std::numbers::pi / 2, 0);
  EXPECT_LT(distance(camera.eye(), {5, 0, 0}), 1e-9);
  camera.turn(0, 0.3);
  EXPECT_NEAR(distance(camera.eye(), {0, 0, 0}), 5, 1e-9);
  EXPECT_GT(camera.eye()[1], 1);
  camera.turn(0, 99);  // not over the top: up stays up
  EXPECT_GT(camera.view().up[1], 0);
  EXPECT_GT(camera.eye()[1], 4.9);
  camera.turn(0, -99);
  EXPECT_GT(camera.view().up[1], 0);
  EXPECT_LT(camera.eye()[1], -4.9);
}

TEST(OrbitCamera, MovedPointsFollowThePointer) {
  OrbitCamera camera({3, -4, 2}, {0, 0, 0}, 'z', 50);
  camera.pan(0.25, -0.1);  // of the height: halves of it are half as large
  const Vec at = project(camera.view(), {0, 0, 0});
  EXPECT_NEAR(at[0], 0.5, 1e-6);
  EXPECT_NEAR(at[1], -0.2, 1e-6);
}

TEST(OrbitCamera, ZoomKeepsTheTargetAndNeverReachesIt) {
  OrbitCamera camera({0, 0, 10}, {0, 0, 0}, 'y', 40);
  camera.zoom(1);
  EXPECT_NEAR(camera.eye()[2], 9, 1e-9);
  camera.zoom(-1);
  EXPECT_NEAR(camera.eye()[2], 10, 1e-9);
  camera.zoom(1e6);
  EXPECT_GT(camera.eye()[2], 0);
  camera.zoom(-1e9);
  EXPECT_TRUE(std::isfinite(camera.eye()[2]));
}

// Every corner lies in the picture, and some nearly at its edge, from whichever side.
TEST(OrbitCamera, FramesABox) {
  const runtime::WorldBox box{{-1, 2, 5}, {3, 4, 6}, false};
  for (const double aspect : {0.5, 1.0, 2.5}) {
    for (int side = 0; side < 12; ++side) {
      OrbitCamera camera({0, 0, 1}, {0, 0, 0}, 'y', 35);
      camera.turn(side * 0.7, side * 0.2 - 1);
      camera.frame(box, aspect);
      double furthest = 0;
      for (int corner = 0; corner < 8; ++corner) {
        Vec point{};
        for (std::size_t i = 0; i < 3; ++i) point[i] = (corner >> i & 1) != 0 ? box.max[i] : box.min[i];
        const Vec at = project(camera.view(), point);
        ASSERT_GT(at[2], 0);
        furthest = std::max({furthest, std::abs(at[0]) / aspect, std::abs(at[1])});
      }
      EXPECT_LE(furthest, 1.07) << aspect << " " << side;
      EXPECT_GT(furthest, 0.8) << aspect << " " << side;
    }
  }
}

TEST(OrbitCamera, AnEmptyBoxChangesNothing) {
  OrbitCamera camera({3, 4, 5}, {0, 0, 0}, 'y', 35);
  camera.frame({}, 1);
  EXPECT_LT(distance(camera.eye(), {3, 4, 5}), 1e-9);
}

}  // namespace
}  // namespace billow::viewer
