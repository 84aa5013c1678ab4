// What metavoxels refuse, and what becomes of more than there is room for.
#include <gtest/gtest.h>

#include <limits>

#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

using runtime::ErrorCode;

class MetavoxelLimits : public MetavoxelTest {
 protected:
  ErrorCode refusal(const MetavoxelConfig& config) {
    const auto made = runtime::Metavoxels::create(*renderer_, config);
    EXPECT_FALSE(made);
    return made ? ErrorCode::vulkan : made.error().code;
  }
  std::string refusal(runtime::Metavoxels& metavoxels, const MetavoxelDraw& draw) {
    const auto drawn = gpu().render(*renderer_, metavoxels, draw, {});
    EXPECT_FALSE(drawn);
    return drawn ? "" : drawn.error().message;
  }
};

TEST_F(MetavoxelLimits, ConfigOutsideOfItsRangeIsRefused) {
  const auto broken = [&](auto change) {
    MetavoxelConfig config = smallConfig();
    change(config);
    return refusal(config);
  };
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.edge = 3; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.edge = 65; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.metavoxels = 0; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.metavoxels = 129; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.metavoxels = 128, c.edge = 64; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.maxMetavoxels = 0; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.maxParticles = 1u << 21; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.maxVolumes = 9; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.recordsInFlight = 0; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.lightField = 11; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.lightField = 161; }), ErrorCode::argument);
  EXPECT_EQ(broken([](MetavoxelConfig& c) { c.memoryBudget = 100'000; }), ErrorCode::budget);
}

TEST_F(MetavoxelLimits, BudgetIsKeptAndGivenBack) {
  const std::uint64_t before = renderer_->bytesInUse();
  for (const std::uint64_t budget : {2'000'000, 3'000'000, 20'000'000}) {
    MetavoxelConfig config = smallConfig();
    config.memoryBudget = budget;
    const auto metavoxels = make(config);
    EXPECT_LE(metavoxels->bytesAllocated(), budget);
    // GPUs round images up, and the pool grows by whole layers of it.
    EXPECT_GT(metavoxels->bytesAllocated(), budget * 5 / 8) << "it is used";
    EXPECT_EQ(renderer_->bytesInUse() - before, metavoxels->bytesAllocated());
  }
  EXPECT_EQ(renderer_->bytesInUse(), before);
  // The renderer's own budget holds too.
  renderer_ = makeRenderer({.gpuBudget = 2'000'000});
  MetavoxelConfig config = smallConfig();
  EXPECT_EQ(refusal(config), ErrorCode::budget);
  EXPECT_LT(renderer_->bytesInUse(), 100'000u);
}

TEST_F(MetavoxelLimits, DrawOutsideOfItsRangeIsRefusedByName) {
  const auto metavoxels = make(smallConfig());
  const auto broken = [&](auto change) {
    MetavoxelDraw draw = smallDraw();
    change(draw);
    return refusal(*metavoxels, draw);
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(broken([](MetavoxelDraw& d) { d.voxelSize = 0; }).find("voxelSize"), std::string::npos);
  EXPECT_NE(broken([](MetavoxelDraw& d) { d.step = 0.01f; }).find("step"), std::string::npos);
  EXPECT_NE(broken([&](MetavoxelDraw& d) { d.center[1] = double{kNan}; }).find("center"), std::string::npos);
  EXPECT_NE(broken([](MetavoxelDraw& d) { d.sun.direction = {0, 0, 0}; }).find("sun"), std::string::npos);
  EXPECT_NE(broken([](MetavoxelDraw& d) { d.scattering.anisotropy = 1; }).find("scattering"), std::string::npos);
  EXPECT_NE(broken([&](MetavoxelDraw& d) { d.scattering.surroundings = kNan; }).find("surroundings"),
            std::string::npos);
  EXPECT_NE(broken([](MetavoxelDraw& d) { d.scattering.surroundings = 1.1f; }).find("surroundings"), std::string::npos);
  EXPECT_NE(broken([](MetavoxelDraw& d) { d.scattering.bounces = 0; }).find("bounces"), std::string::npos);
  EXPECT_NE(broken([](MetavoxelDraw& d) { d.lightExtinction[0] = -1; }).find("lightExtinction"), std::string::npos);
  const auto particle = [&](auto change) {
    std::vector<Particle> particles(3, ball({0, 0, 0}, 1, 1));
    change(particles[2]);
    return broken([&](MetavoxelDraw& d) { d.particles = particles; });
  };
  EXPECT_NE(particle([](Particle& p) { p.material = 2; }).find("particles[2].material"), std::string::npos);
  EXPECT_NE(particle([](Particle& p) { p.map = 0; }).find("particles[2].map"), std::string::npos);
  EXPECT_NE(particle([](Particle& p) { p.kind = 9; }).find("particles[2].kind"), std::string::npos);
  EXPECT_NE(particle([&](Particle& p) { p.radius = kNan; }).find("particles[2].radius"), std::string::npos);
  const std::vector<runtime::MetavoxelVolume> none(1);
  EXPECT_NE(broken([&](MetavoxelDraw& d) { d.volumes = none; }).find("volumes[0].frame"), std::string::npos);
  const std::vector<Particle> many(257, ball({0, 0, 0}, 1, 1));
  EXPECT_NE(broken([&](MetavoxelDraw& d) { d.particles = many; }).find("number"), std::string::npos);
}

TEST_F(MetavoxelLimits, NothingGivesTheBackground) {
  const auto metavoxels = make(smallConfig());
  MetavoxelDraw draw = smallDraw();
  draw.background = {.bottom = {0.25f, 0.5f, 1}, .top = {0.25f, 0.5f, 1}, .opacity = 1};
  const std::vector<Particle> away{ball({100, 0, 0}, 1, 1), ball({0, 0, 0}, 0, 1)};
  for (const bool some : {false, true}) {
    if (some) draw.particles = away;
    const headless::Picture picture = render(*metavoxels, draw);
    EXPECT_EQ(metavoxels->stats().occupied, 0u);
    for (std::size_t i = 0; i < picture.depth.size(); ++i) {
      EXPECT_EQ(picture.rgba[i * 4], 0.25f);
      EXPECT_EQ(picture.rgba[i * 4 + 3], 1);
      EXPECT_EQ(picture.depth[i], std::numeric_limits<float>::infinity());
    }
  }
}

// More than one row of workgroups: a device need not dispatch more than 65535.
TEST_F(MetavoxelLimits, ManyParticlesAreAllBinned) {
  MetavoxelConfig config = smallConfig();
  config.maxParticles = 70000;
  const auto metavoxels = make(config);
  MetavoxelDraw draw = smallDraw();
  std::vector<Particle> particles(70000, ball({0, 0, 0}, 0, 1));
  particles.front() = ball({-2, 0, 0}, 1, 1);
  particles.back() = ball({2, 0, 0}, 1, 1);
  draw.particles = particles;
  const headless::Picture many = render(*metavoxels, draw);
  const std::vector<Particle> two{particles.front(), particles.back()};
  draw.particles = two;
  EXPECT_EQ(largestDifference(render(*metavoxels, draw), many), 0);
  EXPECT_GT(metavoxels->stats().listEntries, 10u);
}

// A draw with more of everything than fits says so, and the next one is as if it had not been.
TEST_F(MetavoxelLimits, TooMuchIsLeftOutOnceOnly) {
  MetavoxelConfig config = smallConfig();
  config.maxMetavoxels = 40;
  config.maxListEntries = 64;
  const auto metavoxels = make(config);
  MetavoxelDraw draw = smallDraw();
  const std::vector<Particle> little{ball({0, 0, 0}, 0.7f, 2), ball({0.5f, 0.2f, 0}, 0.5f, 2)};
  draw.particles = little;
  const headless::Picture before = render(*metavoxels, draw);
  EXPECT_EQ(metavoxels->stats().draw, 1u);
  EXPECT_EQ(metavoxels->stats().drawn, metavoxels->stats().occupied);
  const std::vector<Particle> much(50, ball({0, 0, 0}, 4, 2));
  draw.particles = much;
  render(*metavoxels, draw);
  EXPECT_EQ(metavoxels->stats().draw, 2u);
  EXPECT_EQ(metavoxels->stats().drawn, 40u);
  EXPECT_GT(metavoxels->stats().occupied, 200u);
  EXPECT_GT(metavoxels->stats().listEntries, 64u);
  draw.particles = little;
  const headless::Picture after = render(*metavoxels, draw);
  EXPECT_EQ(metavoxels->stats().drawn, metavoxels->stats().occupied);
  EXPECT_LT(largestDifference(before, after), 1e-5f);
}

}  // namespace
}  // namespace billow::tests
