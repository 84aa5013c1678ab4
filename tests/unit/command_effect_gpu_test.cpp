// The sample effects, compiled by the command: the GPU's particles are the CPU's.
#include <gtest/gtest.h>

#include <string>

#include "metavoxel_fixture.h"
#include "run_command.h"
#include "same_particles.h"

namespace billow::tests {
namespace {

class SampleEffects : public MetavoxelTest, public testing::WithParamInterface<const char*> {};

TEST_P(SampleEffects, HaveTheSameParticlesOnTheGpu) {
  const TempFolder folder;
  const std::string pack = folder / "e.blw";
  const auto compiled = shell(std::string("$BILLOW compile ") + BILLOW_SOURCE_DIR + "/samples/effects/" + GetParam() +
                              ".effect.json -o " + pack);
  ASSERT_EQ(compiled.code, 0) << compiled.err;
  const format::Pack opened = valueOf(format::Pack::openFile(pack), "the sample");
  MetavoxelConfig config = smallConfig();
  config.tables = &opened.effects();
  config.maxParticles = 4096;
  const auto metavoxels = make(config);
  MetavoxelDraw draw = smallDraw();
  draw.width = draw.height = 8;
  draw.view = runtime::lookAt({0, 0, 50}, {0, 0, 100}, {0, 1, 0}, 36);  // away: only particles are asked for
  const float duration = opened.effects().effects[0].duration;
  SameParticles same;
  for (const double runs : {0.0, 0.013, 0.1, 0.37, 0.8, 1.0, 1.62, 7.77}) {
    const runtime::MetavoxelEffect effect{.effect = 0, .time = runs * double{duration}};
    draw.effects = {&effect, 1};
    render(*metavoxels, draw);
    const auto gpus = valueOf(gpu().readParticles(*renderer_, *metavoxels), "particles");
    same.expect(format::particlesAt(opened.effects(), 0, effect.time), gpus);
    ASSERT_FALSE(HasFailure()) << effect.time << " s";
  }
  EXPECT_GT(same.compared(), 100u);
  EXPECT_LE(same.atEnds(), 2u);
}

INSTANTIATE_TEST_SUITE_P(All, SampleEffects,
                         testing::Values("campfire_smoke", "cloud_bank", "dust_devil", "dust_wave", "explosion",
                                         "magic_trail", "steam_jet"),
                         [](const auto& sample) { return std::string(sample.param); });

}  // namespace
}  // namespace billow::tests
