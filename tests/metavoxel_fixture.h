// Metavoxel tests: particles of plain materials in a small space around the origin, and pictures of them.
#ifndef BILLOW_TESTS_METAVOXEL_FIXTURE_H
#define BILLOW_TESTS_METAVOXEL_FIXTURE_H

#include <algorithm>
#include <cmath>

#include "billow/runtime/metavoxel.h"
#include "gpu_fixture.h"

namespace billow::tests {

using format::Particle;
using runtime::MetavoxelConfig;
using runtime::MetavoxelDraw;

// Materials of plainTables(), by number.
inline constexpr std::uint32_t kHard = 0;  // constant density
inline constexpr std::uint32_t kSoft = 1;  // 1 - r^2

inline format::ParticleMaterial material(std::uint32_t profile, float softness) {
  return {.profile = profile,
          .profileRow = format::kNoRow,
          .diffuseRamp = format::kNoRow,
          .emissionRamp = format::kNoRow,
          .erosion = 0,
          .erosionFrequency = 1,
          .occlusion = 0,
          .softness = softness};
}

inline const format::EffectTables& plainTables() {
  static const format::EffectTables tables = [] {
    format::EffectTables made;
    made.materials = {material(format::kProfileConstant, 1e-6f), material(format::kProfileRadial, 1e-6f)};
    return made;
  }();
  return tables;
}

inline Particle ball(std::array<float, 3> center, float radius, float extinction,
                     std::uint32_t materialNumber = kSoft) {
  Particle particle{};
  std::copy(center.begin(), center.end(), particle.center);
  particle.radius = radius;
  particle.rotation[3] = 1;
  std::fill(particle.diffuse, particle.diffuse + 3, 1.0f);
  particle.extinction = extinction;
  particle.kind = format::kKindSphere;
  particle.map = format::kNoMap;
  particle.material = materialNumber;
  return particle;
}

// A space of 96^3 voxels of 0.1 around the origin, in metavoxels of 8^3 (and a border).
inline MetavoxelConfig smallConfig() {
  MetavoxelConfig config;
  config.edge = 10;
  config.metavoxels = 12;
  config.memoryBudget = std::uint64_t{256} << 20;
  config.maxMetavoxels = 1728;
  config.maxParticles = 256;
  config.maxListEntries = 65536;
  config.tables = &plainTables();
  return config;
}

// From the front and a little above, the sun high behind the eye's left shoulder.
inline MetavoxelDraw smallDraw() {
  MetavoxelDraw draw;
  draw.view = runtime::lookAt({3, 2, 16}, {0, 0, 0}, {0, 1, 0}, 36);
  draw.sun = {.direction = {-0.5f, 0.7f, 0.4f}, .irradiance = {8, 8, 8}};
  draw.width = draw.height = 48;
  draw.colorFormat = runtime::ColorFormat::single;
  return draw;
}

// Decibels between two pictures' radiance, the peak being the first's largest.
inline double pictureDecibels(const headless::Picture& a, const headless::Picture& b) {
  double squares = 0, peak = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    if (i % 4 == 3) continue;
    const double difference = double{a.rgba[i]} - double{b.rgba[i]};
    squares += difference * difference;
    peak = std::max(peak, std::abs(double{a.rgba[i]}));
  }
  const double mean = squares / (static_cast<double>(a.rgba.size()) * 0.75);
  return mean > 0 ? 10 * std::log10(peak * peak / mean) : 1000;
}

// The largest difference of any channel.
inline float largestDifference(const headless::Picture& a, const headless::Picture& b) {
  float largest = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) largest = std::max(largest, std::abs(a.rgba[i] - b.rgba[i]));
  return largest;
}

class MetavoxelTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    renderer_ = makeRenderer();
  }
  void TearDown() override {
    GpuTest::TearDown();
    renderer_.reset();
  }

  std::unique_ptr<runtime::Metavoxels> make(const MetavoxelConfig& config) {
    return valueOf(runtime::Metavoxels::create(*renderer_, config), "metavoxels");
  }
  headless::Picture render(runtime::Metavoxels& metavoxels, const MetavoxelDraw& draw,
                           std::span<const float> sceneDepth = {}) {
    return valueOf(gpu().render(*renderer_, metavoxels, draw, sceneDepth), "render");
  }
  // One picture by metavoxels of their own.
  headless::Picture renderOnce(const MetavoxelConfig& config, const MetavoxelDraw& draw) {
    const auto metavoxels = make(config);
    headless::Picture picture = render(*metavoxels, draw);
    lastStats_ = metavoxels->stats();
    gpu().waitIdle();
    return picture;
  }

  std::unique_ptr<runtime::Renderer> renderer_;
  runtime::MetavoxelStats lastStats_;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_METAVOXEL_FIXTURE_H
