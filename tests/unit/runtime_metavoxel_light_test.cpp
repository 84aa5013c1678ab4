// Light in metavoxels, and pictures that must not depend on how the space is cut.
#include <gtest/gtest.h>

#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

constexpr double kPi = 3.14159265358979;

std::vector<Particle> cloud() {
  std::vector<Particle> particles{ball({0, 0, 0}, 2.2f, 1.2f), ball({1.6f, 0.9f, -0.4f}, 1.5f, 2),
                                  ball({-1.7f, 1.4f, 0.6f}, 1.4f, 3), ball({0.2f, 2.2f, 1.1f}, 0.8f, 4),
                                  ball({-0.9f, -1.8f, 1.3f}, 1.2f, 1.5f)};
  particles[1].diffuse[2] = 0.4f;
  particles[2].emission[0] = 0.7f;
  return particles;
}

using MetavoxelLight = MetavoxelTest;

TEST_F(MetavoxelLight, SunBehindTheEyeMatchesTheClosedForm) {
  // A box of fog, seen along its axis and the sun's: the integral of s / (4 pi) e^(-2 s x) over the depth x.
  Particle fog = ball({0, 0, 0}, 4, 0.5f, kHard);
  fog.kind = format::kKindBox;
  // Voxel centres lie at multiples of 0.1, so a box that ends between them fills whole voxels.
  const float sides[3] = {2.05f, 2.05f, 2.05f};
  std::copy(sides, sides + 3, fog.shape);
  const std::vector<Particle> particles{fog};
  MetavoxelDraw draw = smallDraw();
  draw.view = runtime::lookAt({0, 0, 30}, {0, 0, 0}, {0, 1, 0}, 6);
  draw.width = draw.height = 9;
  draw.sun = {.direction = {0, 0, 1}, .irradiance = {1, 1, 1}};
  draw.scattering = {.anisotropy = 0, .ambient = {0, 0, 0}, .orders = 1};
  draw.particles = particles;
  draw.step = 0.25f;
  const auto metavoxels = make(smallConfig());
  const headless::Picture white = render(*metavoxels, draw);
  const float* middle = &white.rgba[(4 * 9 + 4) * 4];
  const double once = 0.5 * 4.1;
  EXPECT_NEAR(middle[3], 1 - std::exp(-once), 1e-3);
  EXPECT_NEAR(middle[0] / ((1 - std::exp(-2 * once)) / (8 * kPi)), 1, 0.01);
  // Coloured light: green loses twice as much, blue nothing.
  draw.lightExtinction = {1, 2, 0};
  const headless::Picture coloured = render(*metavoxels, draw);
  middle = &coloured.rgba[(4 * 9 + 4) * 4];
  EXPECT_NEAR(middle[0] / ((1 - std::exp(-2 * once)) / (8 * kPi)), 1, 0.01);
  EXPECT_NEAR(middle[1] / ((1 - std::exp(-3 * once)) / (12 * kPi)), 1, 0.01);
  EXPECT_NEAR(middle[2] / ((1 - std::exp(-once)) / (4 * kPi)), 1, 0.01);
}

TEST_F(MetavoxelLight, ReciprocalLightIsTheSeedsProduct) {
  Particle fog = ball({0, 0, 0}, 4, 2, kHard);
  fog.kind = format::kKindBox;
  const float sides[3] = {2.05f, 2.05f, 2.05f};
  std::copy(sides, sides + 3, fog.shape);
  const std::vector<Particle> particles{fog};
  MetavoxelDraw draw = smallDraw();
  draw.view = runtime::lookAt({0, 0, 30}, {0, 0, 0}, {0, 1, 0}, 6);
  draw.width = draw.height = 9;
  draw.sun = {.direction = {0, 0, 1}, .irradiance = {1, 1, 1}};
  draw.scattering = {.anisotropy = 0, .ambient = {0, 0, 0}, .orders = 1};
  draw.attenuation = runtime::Attenuation::reciprocal;
  draw.particles = particles;
  draw.step = 0.25f;
  const headless::Picture picture = renderOnce(smallConfig(), draw);
  // 41 voxels of d = 0.2: behind k of them (1 + d)^-k of the light is left; the way to the eye is exponential.
  double expected = 0;
  for (int k = 0; k < 41; ++k) {
    expected += std::pow(1.2, -(k + 0.5)) * (std::exp(-0.2 * k) - std::exp(-0.2 * (k + 1))) / (4 * kPi);
  }
  EXPECT_NEAR(picture.rgba[(4 * 9 + 4) * 4] / expected, 1, 0.01);
}

TEST_F(MetavoxelLight, CutFieldIsTheUncutOne) {
  const std::vector<Particle> particles = cloud();
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  draw.scattering.orders = 3;
  MetavoxelConfig config = smallConfig();
  config.metavoxels = 15;  // 120^3 voxels
  const headless::Picture many = renderOnce(config, draw);
  EXPECT_GT(lastStats_.drawn, 200u);
  config.edge = 62;  // twice 60
  config.metavoxels = 2;
  const headless::Picture few = renderOnce(config, draw);
  EXPECT_EQ(lastStats_.drawn, 8u);
  EXPECT_LT(largestDifference(many, few), 2e-3f);
  EXPECT_GT(pictureDecibels(many, few), 70);
  EXPECT_GT(*std::max_element(many.rgba.begin(), many.rgba.end()), 0.5f);
}

TEST_F(MetavoxelLight, SmallPoolDrawsTheSamePicture) {
  const std::vector<Particle> particles = cloud();
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  draw.cull = false;
  // From below, above, the side and within: all cells are before the eye, none, or some of them.
  const std::array<double, 3> eyes[] = {{3, 2, 16}, {-9, -8, -3}, {4, 8, 8}, {0.4, 0.3, 2.9}, {-6, 0.5, 0}};
  const auto whole = make(smallConfig());
  MetavoxelConfig little = smallConfig();
  little.maxMetavoxels = 700;
  little.memoryBudget = 1'060'000;
  const auto rounds = make(little);
  EXPECT_LE(rounds->bytesAllocated(), little.memoryBudget);
  for (const auto& eye : eyes) {
    draw.view = runtime::lookAt(eye, {0.1, 0.2, 0}, {0, 1, 0}, 50);
    const headless::Picture expected = render(*whole, draw);
    const headless::Picture picture = render(*rounds, draw);
    EXPECT_GE(rounds->stats().drawn, 8 * rounds->poolSlots()) << "of the metavoxels an eighth is resident at most";
    EXPECT_EQ(rounds->stats().drawn, whole->stats().drawn);
    EXPECT_LT(largestDifference(expected, picture), 3e-3f) << eye[0] << ' ' << eye[1] << ' ' << eye[2];
    EXPECT_GT(pictureDecibels(expected, picture), 65);
    for (std::size_t i = 0; i < picture.depth.size(); ++i) {
      if (expected.rgba[i * 4 + 3] < 0.01f) continue;
      EXPECT_NEAR(picture.depth[i], expected.depth[i], 0.02f);
    }
  }
}

TEST_F(MetavoxelLight, CullingChangesNothingThatIsSeen) {
  const std::vector<Particle> particles = cloud();
  MetavoxelDraw draw = smallDraw();
  draw.view = runtime::lookAt({-1, -5, 5}, {-1, -1.5, 1}, {0, 1, 0}, 12);
  draw.particles = particles;
  const auto metavoxels = make(smallConfig());
  draw.cull = false;
  const headless::Picture all = render(*metavoxels, draw);
  const std::uint32_t occupied = metavoxels->stats().occupied;
  draw.cull = true;
  const headless::Picture seen = render(*metavoxels, draw);
  EXPECT_LT(metavoxels->stats().occupied, occupied * 3 / 4);
  EXPECT_LT(largestDifference(all, seen), 1e-4f) << "they lie elsewhere in the pool: the filter rounds otherwise";
}

TEST_F(MetavoxelLight, ShadowFallsFromTheSun) {
  // One ball between the sun and another: the far one is darker than alone, the near one as bright.
  MetavoxelDraw draw = smallDraw();
  draw.sun.direction = {0, 1, 0};
  draw.scattering.ambient = {0, 0, 0};
  const Particle near = ball({0, 2.4f, 0}, 1.2f, 5), far = ball({0, -2, 0}, 1.2f, 5);
  const auto metavoxels = make(smallConfig());
  const auto light = [&](const std::vector<Particle>& particles, bool upper) {
    draw.particles = particles;
    const headless::Picture picture = render(*metavoxels, draw);
    float sum = 0;
    for (std::size_t i = 0; i < 24 * 48; ++i) sum += picture.rgba[((upper ? 0 : 24 * 48) + i) * 4];
    return sum;
  };
  EXPECT_NEAR(light({near, far}, true) / light({near}, true), 1, 0.03);
  EXPECT_LT(light({near, far}, false), 0.4f * light({far}, false));
}

TEST_F(MetavoxelLight, SceneEndsRays) {
  // A plane through the middle of a soft ball, at a different depth for each half of the picture.
  const std::vector<Particle> particles{ball({0, 0, 0}, 3, 0.4f)};
  MetavoxelDraw draw = smallDraw();
  draw.view = runtime::lookAt({0, 0, 20}, {0, 0, 0}, {0, 1, 0}, 20);
  draw.particles = particles;
  std::vector<float> depths(std::size_t{draw.width} * draw.height);
  for (std::size_t i = 0; i < depths.size(); ++i) depths[i] = i % draw.width < draw.width / 2 ? 20.0f : 10.0f;
  const auto metavoxels = make(smallConfig());
  const headless::Picture whole = render(*metavoxels, draw), cut = render(*metavoxels, draw, depths);
  const auto depth = [](const headless::Picture& picture, std::size_t pixel) {
    return -std::log1p(-double{picture.rgba[pixel * 4 + 3]});
  };
  // Rays near the axis are halved by the plane; those aslant are not.
  for (std::uint32_t row = 22; row < 26; ++row) {
    const std::size_t left = std::size_t{row} * 48 + 23, right = left + 1;
    EXPECT_NEAR(depth(cut, left) / depth(whole, left), 0.5, 0.01) << "half of the ball lies before the plane";
    EXPECT_EQ(cut.rgba[right * 4 + 3], 0) << "all of it lies behind the plane";
  }
}

TEST_F(MetavoxelLight, ShadowOnTheSceneIsTheDepthOfTheSpace) {
  // Two balls one above the other, and a third beside them.
  const std::vector<Particle> particles{ball({0, 2.5f, 0}, 1.5f, 0.4f), ball({0, -2, 0}, 2, 0.3f),
                                        ball({-3, 0, 2}, 1, 1)};
  MetavoxelDraw draw = smallDraw();
  draw.sun.direction = {0, 1, 0};
  draw.particles = particles;
  const auto metavoxels = make(smallConfig());
  render(*metavoxels, draw);
  const runtime::MetavoxelShadow image = metavoxels->shadow();
  std::vector<float> shadow = valueOf(gpu().readShadow(*renderer_, *metavoxels), "shadow");
  for (double x = -4.5; x < 4.5; x += 0.1) {
    for (double z = -4.5; z < 4.5; z += 0.1) {
      const double world[4] = {x, 17, z, 1};
      double texel[2] = {};
      for (std::size_t row = 0; row < 2; ++row) {
        for (std::size_t i = 0; i < 4; ++i) texel[row] += image.toTexel[row][i] * world[i];
        EXPECT_NEAR(texel[row] - std::floor(texel[row]), 0.5, 1e-6) << "voxels' centres lie at multiples of 0.1";
      }
      double expected = 0;
      for (const Particle& particle : particles) {
        const double apart = std::pow(x - double{particle.center[0]}, 2) + std::pow(z - double{particle.center[2]}, 2);
        const double r = double{particle.radius}, a = std::sqrt(std::max(r * r - apart, 0.0));
        expected += double{particle.extinction} * 4 * a * a * a / (3 * r * r);
      }
      const auto at = static_cast<std::size_t>(texel[1]) * image.size + static_cast<std::size_t>(texel[0]);
      EXPECT_NEAR(shadow[at], expected, 0.012) << x << ' ' << z;
    }
  }
  // A shadow of the draw before does not stay.
  draw.particles = std::span(particles).first(1);
  render(*metavoxels, draw);
  shadow = valueOf(gpu().readShadow(*renderer_, *metavoxels), "shadow");
  EXPECT_NEAR(*std::max_element(shadow.begin(), shadow.end()), 0.4 * 4.0 / 3 * 1.5, 0.02);
}

}  // namespace
}  // namespace billow::tests
