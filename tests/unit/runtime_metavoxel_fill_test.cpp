// What particles become in metavoxels: closed forms, and the plain evaluation of format/particle_field.h.
#include <gtest/gtest.h>

#include <random>

#include "billow/format/particle_field.h"
#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

using Vec = std::array<double, 3>;

// The ray through a pixel, of length 1 along `forward`.
Vec rayThrough(const MetavoxelDraw& draw, std::uint32_t pixel) {
  const double x = ((pixel % draw.width + 0.5) / draw.width * 2 - 1) * double{draw.view.tanHalfHeight};
  const double y = (1 - (pixel / draw.width + 0.5) / draw.height * 2) * double{draw.view.tanHalfHeight};
  Vec ray{};
  for (std::size_t i = 0; i < 3; ++i) {
    ray[i] = double{draw.view.forward[i]} + x * double{draw.view.right[i]} + y * double{draw.view.up[i]};
  }
  return ray;
}

double length(const Vec& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// The particle with every kind of thing that its density can have.
format::EffectTables richTables() {
  format::EffectTables tables = plainTables();
  format::CurveRow curve{};
  for (std::uint32_t i = 0; i < format::kCurveSamples; ++i) {
    curve.values[i] = 0.3f + 0.7f * std::cos(static_cast<float>(i) * 0.05f);
  }
  tables.curves = {curve};
  format::CubeMap map{};
  std::mt19937 random(7);
  for (std::size_t block = 0; block < map.blocks.size(); block += format::kBc4Bytes) {
    map.blocks[block] = static_cast<std::byte>(120 + random() % 100);
    map.blocks[block + 1] = static_cast<std::byte>(20 + random() % 60);
    for (std::size_t i = 2; i < 8; ++i) map.blocks[block + i] = static_cast<std::byte>(random() & 0xff);
  }
  tables.maps = {format::CubeMap{}, map};
  format::ParticleMaterial rich = material(format::kProfileCurve, 0.3f);
  rich.profileRow = 0;
  rich.erosion = 0.8f;
  rich.erosionFrequency = 3;
  tables.materials.push_back(rich);
  return tables;
}
constexpr std::uint32_t kRich = 2;

Particle richParticle(std::uint32_t kind, std::uint32_t materialNumber) {
  Particle particle = ball({0.2f, -0.3f, 0.4f}, 3, 0.6f, materialNumber);
  particle.kind = kind;
  const float turn[4] = {0.3f, -0.5f, 0.1f, 0.806226f};
  std::copy(turn, turn + 4, particle.rotation);
  const float shapes[format::kKindCount][3] = {{0, 0, 0}, {3, 1.5f, 2}, {1.5f, 0.8f, 0}, {2, 1.2f, 1}};
  std::copy(shapes[kind], shapes[kind] + 3, particle.shape);
  particle.seed = 77;
  return particle;
}

class MetavoxelFill : public MetavoxelTest {
 protected:
  // Optical depth through one particle along each pixel's ray, by fine steps through its plain evaluation; what voxels
  // and filtering blur is blurred in the same way by reading at the corners of a voxel.
  static double referenceDepth(const format::ParticleField& field, const Particle& particle, const MetavoxelDraw& draw,
                               std::uint32_t pixel) {
    const Vec ray = rayThrough(draw, pixel);
    const double dt = double{draw.voxelSize} / 2;
    double sum = 0;
    for (double t = 10; t < 23; t += dt) {
      std::array<float, 3> place{};
      for (std::size_t i = 0; i < 3; ++i) place[i] = static_cast<float>(draw.view.eye[i] + ray[i] * t);
      sum += double{field.sample(particle, place).density};
    }
    return sum * dt * length(ray) * double{particle.extinction};
  }
};

TEST_F(MetavoxelFill, SoftBallTransmitsAsItsClosedForm) {
  MetavoxelDraw draw = smallDraw();
  const std::vector<Particle> particles{ball({0.3f, -0.2f, 0.1f}, 3, 0.4f)};
  draw.particles = particles;
  const headless::Picture picture = renderOnce(smallConfig(), draw);
  float opaque = 0;
  for (std::uint32_t i = 0; i < draw.width * draw.height; ++i) {
    const Vec ray = rayThrough(draw, i);
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
    opaque = std::max(opaque, picture.rgba[i * 4 + 3]);
  }
  EXPECT_GT(opaque, 0.7f);
}

TEST_F(MetavoxelFill, EveryKindIsWhatItsPlainEvaluationIs) {
  const format::EffectTables tables = richTables();
  const format::ParticleField field(tables);
  MetavoxelConfig config = smallConfig();
  config.tables = &tables;
  const auto metavoxels = make(config);
  MetavoxelDraw draw = smallDraw();
  draw.width = draw.height = 24;
  draw.step = 0.5f;
  for (std::uint32_t kind = 0; kind < format::kKindCount; ++kind) {
    for (const bool rich : {false, true}) {
      Particle particle = richParticle(kind, rich ? kRich : kSoft);
      if (rich) {
        particle.map = 1u | 0u << 16;
        particle.kind = format::kindWithShare(kind, 0.4f);
        particle.displacement = 0.5f;
      }
      const std::vector<Particle> particles{particle};
      draw.particles = particles;
      const headless::Picture picture = render(*metavoxels, draw);
      double squares = 0, peak = 0;
      for (std::uint32_t i = 0; i < draw.width * draw.height; ++i) {
        const double expected = 1 - std::exp(-referenceDepth(field, particle, draw, i));
        squares += std::pow(double{picture.rgba[i * 4 + 3]} - expected, 2);
        peak = std::max(peak, expected);
      }
      const double error = std::sqrt(squares / (draw.width * draw.height));
      EXPECT_LT(error, rich ? 0.006 : 0.003) << "kind " << kind << (rich ? ", displaced and eroded" : "");
      EXPECT_GT(peak, 0.3) << "kind " << kind;
    }
  }
}

TEST_F(MetavoxelFill, DensitiesAddAndColoursTakeTheLargest) {
  const auto metavoxels = make(smallConfig());
  MetavoxelDraw draw = smallDraw();
  draw.sun.irradiance = {0, 0, 0};
  draw.scattering.ambient = {1, 1, 1};
  Particle red = ball({0.4f, 0, 0}, 2.5f, 0.3f), green = ball({-0.4f, 0.1f, 0.2f}, 2, 0.5f);
  red.diffuse[1] = red.diffuse[2] = green.diffuse[0] = green.diffuse[2] = 0;
  const std::vector<Particle> one{red}, other{green}, both{red, green};
  const auto depths = [&](const std::vector<Particle>& particles) {
    draw.particles = particles;
    const headless::Picture picture = render(*metavoxels, draw);
    std::vector<double> depth;
    for (std::size_t i = 3; i < picture.rgba.size(); i += 4) depth.push_back(-std::log(1 - double{picture.rgba[i]}));
    return depth;
  };
  const auto first = depths(one), second = depths(other), sum = depths(both);
  for (std::size_t i = 0; i < sum.size(); ++i) EXPECT_NEAR(sum[i], first[i] + second[i], 2e-3 * (1 + sum[i]));
  // In the middle both colours are there in full, so nothing is lost of either.
  const headless::Picture picture = render(*metavoxels, draw);
  const float* middle = &picture.rgba[(24 * 48 + 24) * 4];
  EXPECT_NEAR(middle[0] / middle[3], 1, 0.06);
  EXPECT_NEAR(middle[1] / middle[3], 1, 0.06);
  EXPECT_EQ(middle[2], 0);
}

TEST_F(MetavoxelFill, WeightedColoursAreMeans) {
  const auto metavoxels = make(smallConfig());
  MetavoxelDraw draw = smallDraw();
  draw.sun.irradiance = {0, 0, 0};
  draw.scattering.ambient = {1, 1, 1};
  draw.blend = runtime::Blend::weighted;
  // Three times as much red as green within the small ball, and blue that only glows.
  Particle red = ball({0, 0, 0}, 2, 0.9f, kHard), green = ball({0, 0, 0}, 2, 0.3f, kHard), glow = green;
  red.diffuse[1] = red.diffuse[2] = green.diffuse[0] = green.diffuse[2] = 0;
  glow.extinction = 0;
  glow.emission[0] = 1e-5f;
  std::vector<Particle> particles{red, green, glow};
  draw.particles = particles;
  const headless::Picture first = render(*metavoxels, draw);
  for (std::size_t i = 0; i < first.rgba.size(); i += 4) {
    if (first.rgba[i + 3] < 0.1f) continue;
    EXPECT_NEAR(first.rgba[i] / first.rgba[i + 3], 0.75, 1e-3);
    EXPECT_NEAR(first.rgba[i + 1] / first.rgba[i + 3], 0.25, 1e-3);
    EXPECT_EQ(first.rgba[i + 2], 0);
  }
  EXPECT_GT(first.rgba[(24 * 48 + 24) * 4 + 3], 0.9f);
  std::swap(particles[0], particles[2]);
  EXPECT_LT(largestDifference(first, render(*metavoxels, draw)), 2e-4f);
  draw.blend = runtime::Blend::maximum;
  const headless::Picture largest = render(*metavoxels, draw);
  const float* middle = &largest.rgba[(24 * 48 + 24) * 4];
  EXPECT_NEAR(middle[2] / middle[3], 1, 1e-3) << "a maximum does not ask how much there is";
}

TEST_F(MetavoxelFill, EmissionAddsAndNeedsNoLight) {
  const auto metavoxels = make(smallConfig());
  MetavoxelDraw draw = smallDraw();
  draw.sun.irradiance = {0, 0, 0};
  draw.scattering.ambient = {0, 0, 0};
  Particle glow = ball({0, 0, 0}, 2, 0);
  glow.emission[0] = 3;
  glow.emission[1] = 0.5f;
  const std::vector<Particle> one{glow}, two{glow, glow};
  draw.particles = one;
  const headless::Picture single = render(*metavoxels, draw);
  draw.particles = two;
  const headless::Picture twice = render(*metavoxels, draw);
  // Through the middle, 4/3 R of a soft ball.
  const float* middle = &single.rgba[(24 * 48 + 24) * 4];
  EXPECT_NEAR(middle[0], 3 * 4.0 / 3 * 2, 0.1);
  EXPECT_NEAR(middle[1] / middle[0], 0.5 / 3, 0.005);
  EXPECT_EQ(middle[3], 0) << "nothing is absorbed";
  for (std::size_t i = 0; i < single.rgba.size(); i += 4) {
    EXPECT_NEAR(twice.rgba[i], 2 * single.rgba[i], 0.005f * single.rgba[i] + 1e-5f);
  }
}

TEST_F(MetavoxelFill, WhatIsTooThinToCountIsNotSeen) {
  const auto metavoxels = make(smallConfig());
  MetavoxelDraw draw = smallDraw();
  const std::vector<Particle> one{ball({0, 0, 0}, 1, 2)}, both{one[0], ball({0.3f, 0, 0}, 3, 1e-7f)};
  draw.particles = one;
  const headless::Picture alone = render(*metavoxels, draw);
  draw.particles = both;
  EXPECT_LT(largestDifference(alone, render(*metavoxels, draw)), 1e-4f);
}

TEST_F(MetavoxelFill, OrderOfParticlesChangesNothing) {
  std::vector<Particle> particles;
  std::mt19937 random(3);
  const auto number = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() & 0xffff) / 65535;
  };
  for (int i = 0; i < 50; ++i) {
    particles.push_back(ball({number(-3, 3), number(-3, 3), number(-3, 3)}, number(0.2f, 1.5f), number(0.1f, 2)));
    for (float& channel : particles.back().diffuse) channel = number(0, 1);
    particles.back().emission[i % 3] = number(0, 1);
  }
  const auto metavoxels = make(smallConfig());
  MetavoxelDraw draw = smallDraw();
  draw.particles = particles;
  const headless::Picture first = render(*metavoxels, draw);
  std::shuffle(particles.begin(), particles.end(), random);
  const headless::Picture second = render(*metavoxels, draw);
  // What is left is where metavoxels lie in the pool: GPUs round the filter's coordinates and weights.
  EXPECT_LT(largestDifference(first, second), 2e-4f);
  EXPECT_GT(pictureDecibels(first, second), 100);
  EXPECT_GT(*std::max_element(first.rgba.begin(), first.rgba.end()), 0.5f);
}

}  // namespace
}  // namespace billow::tests
