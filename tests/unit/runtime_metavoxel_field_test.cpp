// Light from matter to matter in metavoxels, against integrals that the CPU takes.
#include <gtest/gtest.h>

#include <functional>

#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

using Point = std::array<double, 3>;

constexpr double kPi = 3.14159265358979;

// A small space with a light field of voxels of 0.8.
MetavoxelConfig fieldConfig() {
  MetavoxelConfig config = smallConfig();
  config.lightField = 12;
  return config;
}

// Nothing but what matter gives off, once scattered, from the front. Voxels lie evenly around the origin.
MetavoxelDraw fieldDraw() {
  MetavoxelDraw draw = smallDraw();
  draw.view = runtime::lookAt({0, 0, 60}, {0, 0, 0}, {0, 1, 0}, 9);
  draw.sun = {.direction = {0, 0, 1}, .irradiance = {0, 0, 0}};
  draw.scattering = {.anisotropy = 0, .ambient = {0, 0, 0}, .orders = 1, .surroundings = 1, .bounces = 1};
  draw.anchor = {0.05, 0.05, 0.05};
  return draw;
}

Particle box(std::array<float, 3> center, std::array<float, 3> half, float extinction) {
  Particle particle = ball(center, 6, extinction, kHard);
  particle.kind = format::kKindBox;
  std::copy(half.begin(), half.end(), particle.shape);
  return particle;
}

Particle glowing(Particle particle, float emission) {
  std::fill(particle.emission, particle.emission + 3, emission);
  return particle;
}

double pixel(const headless::Picture& picture, std::uint32_t x, std::uint32_t y, std::uint32_t channel = 0) {
  return double{picture.rgba[(std::size_t{y} * picture.width + x) * 4 + channel]};
}

// Sum of a channel of all pixels.
double total(const headless::Picture& picture, std::size_t channel) {
  double sum = 0;
  for (std::size_t i = channel; i < picture.rgba.size(); i += 4) sum += double{picture.rgba[i]};
  return sum;
}

// Mean over all directions of the radiance that a ball's emission brings to a place, through `extinction`, by brute
// force.
double lightFrom(const Particle& source, const Point& at, const std::function<double(const Point&)>& extinction) {
  constexpr int kAcross = 8, kSteps = 40;
  const double r = double{source.radius}, step = 2 * r / kAcross;
  double sum = 0;
  for (int i = 0; i < kAcross * kAcross * kAcross; ++i) {
    const double offset[3] = {(i % kAcross + 0.5) * step - r, (i / kAcross % kAcross + 0.5) * step - r,
                              (i / kAcross / kAcross + 0.5) * step - r};
    double squared = 0, depth = 0;
    Point way{};
    if (std::hypot(offset[0], offset[1], offset[2]) > r) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      way[axis] = double{source.center[axis]} + offset[axis] - at[axis];
      squared += way[axis] * way[axis];
    }
    for (int k = 0; k < kSteps; ++k) {
      const double share = (k + 0.5) / kSteps;
      depth += extinction({at[0] + way[0] * share, at[1] + way[1] * share, at[2] + way[2] * share});
    }
    sum += std::exp(-depth * std::sqrt(squared) / kSteps) / (4 * kPi * squared);
  }
  return sum * step * step * step * double{source.emission[0]};
}

using MetavoxelField = MetavoxelTest;

constexpr double kPixel = 2 * 60 * 0.0787017068246 / 48;  // of fieldDraw(), at the origin; tan(4.5 degrees)

// Where the middle of a pixel of fieldDraw() meets z = 0.
Point placeOf(std::uint32_t x, std::uint32_t y) {
  return {(x - 23.5) * kPixel, (23.5 - y) * kPixel, 0};
}

TEST_F(MetavoxelField, ThinSlabBesideAGlowingBallMatchesTheIntegral) {
  const std::vector<Particle> particles{glowing(ball({-3.3f, 0.3f, 0}, 0.8f, 0.1f, kHard), 2),
                                        box({1.2f, 0, 0}, {3, 4, 0.3f}, 0.05f)};
  MetavoxelDraw draw = fieldDraw();
  draw.particles = particles;
  const headless::Picture picture = renderOnce(fieldConfig(), draw);
  const auto extinction = [](const Point& p) {
    const bool inSlab = std::abs(p[0] - 1.2) < 3 && std::abs(p[1]) < 4 && std::abs(p[2]) < 0.3;
    return (inSlab ? 0.05 : 0.0) + (std::hypot(p[0] + 3.3, p[1] - 0.3, p[2]) < 0.8 ? 0.1 : 0.0);
  };
  double sum = 0, count = 0;
  for (std::uint32_t y = 6; y < 42; y += 3) {
    for (std::uint32_t x = 18; x < 42; x += 3) {
      const double expected = lightFrom(particles[0], placeOf(x, y), extinction);
      const double ratio = pixel(picture, x, y) / pixel(picture, x, y, 3) / expected;
      EXPECT_NEAR(ratio, 1, 0.3) << x << ' ' << y;
      sum += ratio;
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, 1, 0.12);
}

// The glow around a fire in fog: light falls off by distance and by fog, on its way to the fog and on to the eye. A
// cone's width blurs what fog takes away: the denser it is, the more comes through.
TEST_F(MetavoxelField, GlowInFogMatchesTheIntegral) {
  for (const float fog : {0.1f, 0.4f}) {
    const std::vector<Particle> particles{glowing(ball({-0.4f, 0.3f, 0}, 0.9f, 0.1f, kHard), 2),
                                          box({0, 0, 0}, {4, 4, 4}, fog)};
    MetavoxelDraw draw = fieldDraw();
    draw.particles = particles;
    const headless::Picture picture = renderOnce(fieldConfig(), draw);
    const auto extinction = [&](const Point& p) {
      const bool inFog = std::abs(p[0]) < 4 && std::abs(p[1]) < 4 && std::abs(p[2]) < 4;
      return (inFog ? double{fog} : 0.0) + (std::hypot(p[0] + 0.4, p[1] - 0.3, p[2]) < 0.9 ? 0.1 : 0.0);
    };
    double sum = 0, count = 0;
    for (std::uint32_t y = 6; y < 42; y += 4) {
      for (std::uint32_t x = 5; x < 43; x += 4) {
        Point at = placeOf(x, y);
        if (std::hypot(at[0] + 0.4, at[1] - 0.3) < 1.3) continue;  // it glows itself
        double expected = 0;
        for (int k = 0; k < 16; ++k) {
          at[2] = 4 - (k + 0.5) / 2;
          expected += lightFrom(particles[0], at, extinction) * std::exp(-double{fog} * (4 - at[2])) * double{fog} / 2;
        }
        const double ratio = pixel(picture, x, y) / expected;
        EXPECT_NEAR(ratio, 1, fog < 0.2f ? 0.4 : 1) << x << ' ' << y << ' ' << fog;
        EXPECT_GT(ratio, 0.6) << x << ' ' << y << ' ' << fog;
        sum += ratio;
        ++count;
      }
    }
    EXPECT_NEAR(sum / count, 1, fog < 0.2f ? 0.15 : 0.3) << fog;
  }
}

TEST_F(MetavoxelField, DenseMatterStopsIt) {
  // A glowing ball and a mote, with a wall between them or none; above it the light comes round.
  const std::vector<Particle> particles{glowing(ball({-2.4f, 0, 0}, 0.8f, 0.2f, kHard), 2),
                                        ball({2.4f, 0, 0}, 0.5f, 0.1f, kHard), box({0, 0, 0}, {0.4f, 4.6f, 4.6f}, 12)};
  MetavoxelDraw draw = fieldDraw();
  const auto mote = [&](std::size_t count) {
    draw.particles = std::span(particles).first(count);
    return pixel(renderOnce(fieldConfig(), draw), 36, 24);
  };
  const double open = mote(2), walled = mote(3);
  EXPECT_GT(open, 1e-4);
  EXPECT_LT(walled, open / 25);
}

TEST_F(MetavoxelField, SymmetricSceneIsLitSymmetrically) {
  std::vector<Particle> particles{glowing(ball({0, 0, 0}, 0.9f, 1), 1)};
  for (const float side : {-2.5f, 2.5f}) {
    particles.push_back(ball({side, 0, 0}, 0.8f, 1));
    particles.push_back(ball({0, side, 0}, 0.8f, 1));
  }
  MetavoxelDraw draw = fieldDraw();
  draw.particles = particles;
  draw.scattering.bounces = 3;
  const headless::Picture picture = renderOnce(fieldConfig(), draw);
  const auto largest = double{*std::max_element(picture.rgba.begin(), picture.rgba.end())};
  double lit = 0;
  for (std::uint32_t y = 0; y < 48; ++y) {
    for (std::uint32_t x = 0; x < 48; ++x) {
      const double here = pixel(picture, x, y);
      EXPECT_NEAR(here, pixel(picture, 47 - x, y), largest * 2e-3);
      EXPECT_NEAR(here, pixel(picture, x, 47 - y), largest * 2e-3);
      EXPECT_NEAR(here, pixel(picture, y, x), largest * 2e-3);
      if (x > 32) lit += here;
    }
  }
  EXPECT_GT(lit, 0.1) << "what does not glow itself is lit";
}

// Of a white ball in the sun, seen from all sides: what leaves it, as a share of what it takes from the sun.
TEST_F(MetavoxelField, WhiteCloudGivesBackNoMoreThanItGets) {
  const std::vector<Particle> particles{ball({0, 0, 0}, 2.4f, 3, kHard)};
  MetavoxelDraw draw = fieldDraw();
  draw.sun.irradiance = {4, 4, 4};
  draw.particles = particles;
  const auto metavoxels = make(fieldConfig());
  const Point sides[6] = {{0, 0, 60}, {0, 0, -60}, {60, 0, 0}, {-60, 0, 0}, {0, 60, 0}, {0, -60, 0}};
  const auto shareOf = [&](std::uint32_t bounces, double& shadowSide) {
    draw.scattering.surroundings = bounces > 0 ? 1 : 0;
    draw.scattering.bounces = std::max(bounces, 1u);
    double radiance = 0, taken = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      draw.view = runtime::lookAt(sides[i], {0, 0, 0}, {0.6, 0.8, 0.1}, 6);
      const headless::Picture picture = render(*metavoxels, draw);
      radiance += total(picture, 0) / 6;
      if (i == 0) taken = total(picture, 3) * 4;
      if (i == 1) shadowSide = pixel(picture, 24, 24);
    }
    return radiance * 4 * kPi / taken;
  };
  double dark = 0, shadow = 0;
  double before = shareOf(0, dark);
  EXPECT_GT(before, 0.2);
  for (const std::uint32_t bounces : {1u, 2u, 4u, 8u}) {
    const double share = shareOf(bounces, shadow);
    EXPECT_GT(share, before * 1.02) << bounces;
    EXPECT_LE(share, 1) << bounces;
    before = share;
  }
  EXPECT_GT(before, 0.65) << "most of it comes back";
  EXPECT_GT(shadow, 3 * dark) << "its far side is lit through it";
}

std::vector<Particle> burningCloud() {
  std::vector<Particle> particles{ball({0, 0, 0}, 2.2f, 1.2f), ball({1.6f, 0.9f, -0.4f}, 1.5f, 2),
                                  ball({-1.7f, 1.4f, 0.6f}, 1.4f, 3), ball({0.2f, 2.2f, 1.1f}, 0.8f, 4),
                                  glowing(ball({-0.9f, -1.8f, 1.3f}, 0.7f, 0.5f), 3)};
  particles[1].diffuse[2] = 0.4f;
  return particles;
}

TEST_F(MetavoxelField, OffIsWithout) {
  const std::vector<Particle> particles = burningCloud();
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  const headless::Picture without = renderOnce(smallConfig(), draw);
  const headless::Picture with = renderOnce(fieldConfig(), draw);
  EXPECT_GT(largestDifference(without, with), 0.05f);
  draw.scattering.surroundings = 0;
  // Two draws place metavoxels differently in the pool: the filter rounds otherwise.
  EXPECT_LT(largestDifference(without, renderOnce(fieldConfig(), draw)), 1e-4f);
}

TEST_F(MetavoxelField, DoesNotDependOnHowTheSpaceIsCut) {
  const std::vector<Particle> particles = burningCloud();
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  draw.scattering.bounces = 3;
  MetavoxelConfig config = fieldConfig();
  const headless::Picture many = renderOnce(config, draw);
  EXPECT_GT(lastStats_.drawn, 200u);
  config.edge = 50;  // 2 of 48 voxels, and so 2 of 6 of the field's
  config.metavoxels = 2;
  const headless::Picture few = renderOnce(config, draw);
  EXPECT_EQ(lastStats_.drawn, 8u);
  EXPECT_LT(largestDifference(many, few), 2e-3f);
  EXPECT_GT(pictureDecibels(many, few), 70);
  // Here the field's voxels are of 7.5 and lie elsewhere.
  config.edge = 32;
  config.metavoxels = 4;
  config.lightField = 16;
  EXPECT_GT(pictureDecibels(many, renderOnce(config, draw)), 40);
  // Where there is room for fewer of them they are larger: here of 30.
  config.lightField = 4;
  EXPECT_GT(pictureDecibels(many, renderOnce(config, draw)), 28);
}

TEST_F(MetavoxelField, SmallPoolDrawsTheSamePicture) {
  const std::vector<Particle> particles = burningCloud();
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  draw.cull = false;
  const auto whole = make(fieldConfig());
  MetavoxelConfig little = fieldConfig();
  little.maxMetavoxels = 700;
  little.memoryBudget = 1'200'000;
  const auto rounds = make(little);
  EXPECT_LE(rounds->bytesAllocated(), little.memoryBudget);
  for (const auto& eye : {Point{3, 2, 16}, Point{-9, -8, -3}, Point{0.4, 0.3, 2.9}}) {
    draw.view = runtime::lookAt(eye, {0.1, 0.2, 0}, {0, 1, 0}, 50);
    const headless::Picture expected = render(*whole, draw);
    const headless::Picture picture = render(*rounds, draw);
    EXPECT_GE(rounds->stats().drawn, 8 * rounds->poolSlots()) << "of the metavoxels an eighth is resident at most";
    EXPECT_LT(largestDifference(expected, picture), 3e-3f) << eye[0] << ' ' << eye[1] << ' ' << eye[2];
    EXPECT_GT(pictureDecibels(expected, picture), 65);
  }
}

TEST_F(MetavoxelField, MetavoxelsThatStayFilledAreLitAlike) {
  std::vector<Particle> particles = burningCloud();
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  draw.refill = runtime::Refill::changed;
  MetavoxelConfig config = fieldConfig();
  config.keepFilled = true;
  const auto kept = make(config);
  for (std::uint32_t i = 0; i < 3; ++i) {
    if (i == 2) particles[4].emission[1] = 9;
    const headless::Picture picture = render(*kept, draw);
    EXPECT_EQ(kept->stats().filled == 0, i == 1);
    MetavoxelDraw anew = draw;
    anew.refill = runtime::Refill::always;
    const headless::Picture expected = renderOnce(fieldConfig(), anew);
    EXPECT_LT(largestDifference(picture, expected), 5e-3f) << i;
    EXPECT_GT(pictureDecibels(picture, expected), 55) << i;
  }
}

// A pool that is smaller than maxMetavoxels but holds the draw: nothing is filled a second time for the field.
TEST_F(MetavoxelField, WhatFitsIsFilledOnce) {
  const std::vector<Particle> particles = burningCloud();
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  const headless::Picture expected = renderOnce(fieldConfig(), draw);
  for (const bool keep : {false, true}) {
    draw.refill = keep ? runtime::Refill::changed : runtime::Refill::always;
    MetavoxelConfig config = fieldConfig();
    config.keepFilled = keep;
    config.memoryBudget = std::uint64_t{14} << 20;
    const auto metavoxels = make(config);
    ASSERT_LT(metavoxels->poolSlots(), config.maxMetavoxels);
    for (int again = 0; again < 2; ++again) {
      EXPECT_GT(pictureDecibels(render(*metavoxels, draw), expected), 55);
      const runtime::MetavoxelStats stats = metavoxels->stats();
      ASSERT_LE(stats.drawn, metavoxels->poolSlots());
      EXPECT_EQ(stats.filled, keep && again == 1 ? 0 : stats.drawn);
    }
  }
}

TEST_F(MetavoxelField, WhatIsBesideTheViewLightsWhatIsInIt) {
  // The ball is 30 voxels outside of a view of a mote; a second draw has forgotten the first.
  const std::vector<Particle> particles{glowing(ball({-3.5f, 0, 0}, 0.6f, 0.2f, kHard), 5),
                                        ball({1.5f, 0, 0}, 0.6f, 0.5f, kHard)};
  MetavoxelDraw draw = fieldDraw();
  draw.view = runtime::lookAt({1.5, 0, 60}, {1.5, 0, 0}, {0, 1, 0}, 2);
  draw.particles = particles;
  const auto metavoxels = make(fieldConfig());
  draw.cull = false;
  const headless::Picture all = render(*metavoxels, draw);
  EXPECT_GT(pixel(all, 24, 24), 1e-3);
  draw.cull = true;
  EXPECT_LT(largestDifference(all, render(*metavoxels, draw)), 1e-5f);
  draw.particles = std::span(particles).last(1);
  EXPECT_EQ(pixel(render(*metavoxels, draw), 24, 24), 0);
}

}  // namespace
}  // namespace billow::tests
