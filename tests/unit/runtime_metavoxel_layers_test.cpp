// Volumes drawn as layers: weighted frames, and frames that are carried along their velocity.
#include <gtest/gtest.h>

#include "layers_fixture.h"
#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

using runtime::Layer;
using runtime::MetavoxelVolume;

runtime::Look cloudLook() {
  runtime::Look look;
  look.extinctionScale = 7.5f;
  look.emissionScale = 4;
  look.temperatureScale = 1500;
  return look;
}

class MetavoxelLayers : public MetavoxelTest {
 protected:
  static MetavoxelDraw cloudDraw() {
    MetavoxelDraw draw = smallDraw();
    draw.center = {kMiddle, kMiddle, kMiddle};
    draw.view = runtime::lookAt({kMiddle + 3, kMiddle + 2, kMiddle + 16}, draw.center, {0, 1, 0}, 20);
    draw.width = draw.height = 64;
    draw.sun.direction = {0, 1, 0};
    draw.blend = runtime::Blend::weighted;
    return draw;
  }
  // The cloud's frame with its velocity grids.
  std::unique_ptr<runtime::Frame> uploadMoving(const format::Pack& pack, std::uint32_t frame = 0) {
    const format::VolumeRecord& volume = pack.volumes()[0];
    return upload(*renderer_, pack, frame,
                  {.grids = runtime::withVelocity(pack, volume, runtime::chooseGrids(pack, volume))});
  }
  headless::Picture drawVolume(const MetavoxelVolume& volume) {
    if (!metavoxels_) metavoxels_ = make(smallConfig());
    MetavoxelDraw draw = cloudDraw();
    draw.volumes = {&volume, 1};
    return render(*metavoxels_, draw);
  }
  // Optical depths of the space's columns, which are the same to the bit wherever metavoxels lie in the pool.
  std::vector<float> depthsOf(std::vector<Layer> layers) {
    draw(std::move(layers));
    return valueOf(gpu().readShadow(*renderer_, *metavoxels_), "shadow");
  }
  void TearDown() override {
    gpu().waitIdle();
    metavoxels_.reset();
    MetavoxelTest::TearDown();
  }
  headless::Picture draw(std::vector<Layer> layers) {
    return drawVolume(MetavoxelVolume{.layers = layers, .look = cloudLook()});
  }
  // The frame as it is, moved as a whole.
  headless::Picture drawMoved(const runtime::Frame& frame, const std::array<double, 3>& way) {
    MetavoxelVolume volume{.frame = &frame, .look = cloudLook()};
    for (std::size_t i = 0; i < 3; ++i) volume.objectToWorld[i * 4 + 3] = way[i];
    return drawVolume(volume);
  }

  std::unique_ptr<runtime::Metavoxels> metavoxels_;
};

TEST_F(MetavoxelLayers, WeightedHalvesOfAFrameAreTheFrame) {
  for (const bool burning : {false, true}) {
    const format::Pack pack = openPack(movingCloudPack({.burning = burning}));
    const auto frame = upload(*renderer_, pack);
    const headless::Picture whole = draw({{.frame = frame.get()}});
    EXPECT_GT(*std::max_element(whole.rgba.begin(), whole.rgba.end()), 0.5f);
    EXPECT_GT(pictureDecibels(whole, drawVolume({.frame = frame.get(), .look = cloudLook()})), 80);
    for (const float weight : {0.1f, 0.5f, 0.7f}) {
      const headless::Picture sum = draw({{frame.get(), weight}, {frame.get(), 1 - weight}});
      EXPECT_GT(pictureDecibels(whole, sum), 55) << weight;
    }
    const headless::Picture four =
        draw({{frame.get(), 0.25f}, {frame.get(), 0.25f}, {frame.get(), 0.25f}, {frame.get(), 0.25f}});
    EXPECT_GT(pictureDecibels(whole, four), 55);
  }
}

TEST_F(MetavoxelLayers, WeightlessAndEmptyLayersAreNotThere) {
  const format::Pack pack = openPack(movingCloudPack({.burning = true}));
  const format::Pack emptyPack = openPack(smallestPack());
  const auto frame = upload(*renderer_, pack), empty = upload(*renderer_, emptyPack);
  const std::vector<float> alone = depthsOf({{frame.get(), 0.6f}});
  EXPECT_GT(*std::max_element(alone.begin(), alone.end()), 1);
  EXPECT_EQ(depthsOf({{frame.get(), 0}, {frame.get(), 0.6f}}), alone);
  EXPECT_EQ(depthsOf({{frame.get(), 0.6f}, {empty.get(), 0.4f}}), alone);
  const headless::Picture none = draw({{frame.get(), 0}, {empty.get(), 1}});
  EXPECT_EQ(*std::max_element(none.rgba.begin(), none.rgba.end()), 0);
}

// Optical depth through the middle of slabs is the weighted sum of theirs, whatever their levels of detail.
TEST_F(MetavoxelLayers, ExtinctionIsLinearInTheWeights) {
  const format::Pack thinPack = openPack(slabPack(0.25f, 1)), densePack = openPack(slabPack(0.75f, 1)),
                     coarsePack = openPack(slabPack(0.75f, 2));
  const auto thin = upload(*renderer_, thinPack), dense = upload(*renderer_, densePack),
             coarse = upload(*renderer_, coarsePack);
  runtime::Look look;
  look.extinctionScale = 1.5f;
  const auto metavoxels = make(smallConfig());
  for (const runtime::Frame* other : {dense.get(), coarse.get()}) {
    for (const float weight : {0.0f, 0.25f, 0.6f, 1.0f}) {
      const std::vector<Layer> layers{{thin.get(), 1 - weight}, {other, weight}};
      const MetavoxelVolume volume{.layers = layers, .look = look};
      MetavoxelDraw draw = cloudDraw();
      draw.view = runtime::lookAt({kMiddle, kMiddle, kMiddle + 16}, draw.center, {0, 1, 0}, 17);
      draw.volumes = {&volume, 1};
      const headless::Picture picture = render(*metavoxels, draw);
      const double depth = -std::log1p(-double{picture.rgba[(32 * 64 + 32) * 4 + 3]});
      EXPECT_NEAR(depth, 4.8 * (0.25 * (1 - double{weight}) + 0.75 * double{weight}), 0.012) << weight;
    }
  }
  gpu().waitIdle();
}

// In whatever order the device has filled the blocks of two layers.
TEST_F(MetavoxelLayers, DrawnAgainIsTheSame) {
  const format::Pack pack = openPack(movingCloudPack({.burning = true}));
  const format::Pack shifted = openPack(movingCloudPack({.burning = true, .shift = 8}));
  const auto first = upload(*renderer_, pack), second = upload(*renderer_, shifted);
  const std::vector<Layer> layers{{first.get(), 0.3f}, {second.get(), 0.7f}};
  const std::vector<float> depths = depthsOf(layers);
  const headless::Picture picture = draw(layers);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(depthsOf(layers), depths);
    EXPECT_GT(pictureDecibels(picture, draw(layers)), 90) << "metavoxels lie elsewhere in the pool";
    metavoxels_ = make(smallConfig());
  }
}

TEST_F(MetavoxelLayers, AStepOfNoTimeChangesNoBit) {
  for (const bool burning : {false, true}) {
    const format::Pack pack = openPack(movingCloudPack({.burning = burning, .velocity = {3, -2, 1}}));
    const auto still = upload(*renderer_, pack), moving = uploadMoving(pack);
    EXPECT_GT(moving->stats().payload(), still->stats().payload());
    const std::vector<float> expected = depthsOf({{still.get()}});
    EXPECT_EQ(depthsOf({{moving.get()}}), expected);
    EXPECT_EQ(depthsOf({{still.get(), 1, 0.1f}}), expected) << "nothing to be carried along";
    EXPECT_NE(depthsOf({{moving.get(), 1, 0.1f}}), expected);
    const headless::Picture picture = draw({{still.get()}});
    EXPECT_GT(pictureDecibels(picture, draw({{moving.get()}})), 80);
  }
}

TEST_F(MetavoxelLayers, ConstantVelocityMovesTheWhole) {
  for (const bool burning : {false, true}) {
    const format::Pack pack = openPack(movingCloudPack({.burning = burning, .velocity = {3, -2, 1}}));
    const auto frame = uploadMoving(pack);
    const headless::Picture still = draw({{frame.get()}});
    // Voxels are 0.1, metavoxels 0.8: whole voxels, parts of them, and more than a metavoxel.
    for (const float seconds : {0.1f, -0.1f, 0.0137f, 0.37f, -0.41f}) {
      const double t = double{seconds};
      const headless::Picture carried = draw({{frame.get(), 1, seconds}});
      const headless::Picture moved = drawMoved(*frame, {3 * t, -2 * t, 1 * t});
      EXPECT_GT(pictureDecibels(moved, carried), burning ? 48 : 60) << seconds;
      EXPECT_LT(pictureDecibels(moved, still), burning ? 40 : 45) << "the test sees motion";
    }
  }
}

// Simulations have velocity only where there is gas: its front goes on into where there was none, and leaves nothing.
TEST_F(MetavoxelLayers, FrontsGoOnWhereNoVelocityIs) {
  const format::Pack pack = openPack(movingCloudPack({.velocity = {3, -2, 1}, .tight = true}));
  const auto frame = uploadMoving(pack);
  for (const float seconds : {0.1f, -0.15f}) {
    const double t = double{seconds};
    const headless::Picture moved = drawMoved(*frame, {3 * t, -2 * t, 1 * t});
    EXPECT_GT(pictureDecibels(moved, draw({{frame.get(), 1, seconds}})), 50) << seconds;
  }
}

TEST_F(MetavoxelLayers, VelocityIsOfTheVolumesOwnWorld) {
  const format::Pack pack = openPack(movingCloudPack({.velocity = {3, -2, 1}}));
  const auto frame = uploadMoving(pack);
  // A quarter turn around y through the cloud's middle: x to -z, z to x.
  MetavoxelVolume volume{.look = cloudLook()};
  volume.objectToWorld = {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 2 * kMiddle};
  volume.velocityScale = 0.5f;
  const std::vector<Layer> layers{{frame.get(), 1, 0.3f}};
  volume.layers = layers;
  const headless::Picture carried = drawVolume(volume);
  volume.layers = {};
  volume.frame = frame.get();
  volume.objectToWorld[3] += 0.15 * 1;
  volume.objectToWorld[7] += 0.15 * -2;
  volume.objectToWorld[11] += 0.15 * -3;
  EXPECT_GT(pictureDecibels(drawVolume(volume), carried), 55);
}

// The way between two frames, from both sides: no double edges where blending has them.
TEST_F(MetavoxelLayers, BothSidesMeetInTheMiddle) {
  // 8 voxels in a tenth of a second.
  const std::array<float, 3> velocity{8, 0, 0};
  const format::Pack before = openPack(movingCloudPack({.velocity = velocity}));
  const format::Pack after = openPack(movingCloudPack({.velocity = velocity, .shift = 8}));
  const auto first = uploadMoving(before), second = uploadMoving(after);
  for (const float share : {0.25f, 0.5f, 0.9f}) {
    const headless::Picture expected = drawMoved(*first, {double{share} * 0.8, 0, 0});
    const headless::Picture carried =
        draw({{first.get(), 1 - share, share * 0.1f}, {second.get(), share, (share - 1) * 0.1f}});
    EXPECT_GT(pictureDecibels(expected, carried), 55) << share;
    const headless::Picture blended = draw({{first.get(), 1 - share}, {second.get(), share}});
    EXPECT_LT(pictureDecibels(expected, blended), 40) << share;
  }
}

// A whirl: what a step back with the velocity half way leaves of a quarter turn's part.
TEST_F(MetavoxelLayers, WhirlsTurn) {
  const format::Pack pack = openPack(movingCloudPack({.whirl = true}));
  const auto frame = uploadMoving(pack);
  const headless::Picture carried = draw({{frame.get(), 1, 0.3f}});
  MetavoxelVolume turned{.frame = frame.get(), .look = cloudLook()};
  const double c = std::cos(0.3), s = std::sin(0.3);  // a radian a second around z
  turned.objectToWorld = {
      c, -s, 0, kMiddle - c * kMiddle + s * kMiddle, s, c, 0, kMiddle - s * kMiddle - c * kMiddle, 0, 0, 1, 0};
  EXPECT_GT(pictureDecibels(drawVolume(turned), carried), 38);
  EXPECT_LT(pictureDecibels(drawVolume(turned), draw({{frame.get()}})), 32);
}

TEST_F(MetavoxelLayers, WhatChangesIsFilledAnew) {
  const format::Pack pack = openPack(movingCloudPack({.velocity = {3, -2, 1}}));
  const auto frame = uploadMoving(pack), other = uploadMoving(pack);
  MetavoxelConfig config = smallConfig();
  config.keepFilled = true;
  const auto metavoxels = make(config);
  std::vector<Layer> layers{{frame.get(), 0.5f, 0.05f}, {other.get(), 0.5f, -0.05f}};
  const auto fresh = make(config);
  const auto filled = [&](runtime::Metavoxels& by, runtime::Refill refill) {
    const MetavoxelVolume volume{.layers = layers, .look = cloudLook()};
    MetavoxelDraw draw = cloudDraw();
    draw.cull = false;
    draw.refill = refill;
    draw.volumes = {&volume, 1};
    const headless::Picture picture = render(by, draw);
    return std::pair(by.stats().filled, picture);
  };
  using enum runtime::Refill;
  EXPECT_GT(filled(*metavoxels, changed).first, 0u);
  const auto changes = [&](const char* what) {
    const auto drawn = filled(*metavoxels, changed);
    EXPECT_GT(drawn.first, 0u) << what;
    EXPECT_EQ(filled(*metavoxels, changed).first, 0u) << what;
    EXPECT_LT(largestDifference(filled(*fresh, always).second, drawn.second), 6e-4f) << what;
  };
  layers[0].weight = 0.75f;
  changes("weight");
  layers[1].advect = -0.3f;
  changes("advection");
  layers.pop_back();
  changes("a layer less");
  layers[0].frame = other.get();
  changes("frame");
  gpu().waitIdle();
}

TEST_F(MetavoxelLayers, RefusesWhatIsNoLayer) {
  const format::Pack pack = openPack(movingCloudPack({}));
  const auto frame = upload(*renderer_, pack);
  const auto metavoxels = make(smallConfig());
  const auto messageOf = [&](const MetavoxelVolume& volume) {
    MetavoxelDraw draw = cloudDraw();
    draw.volumes = {&volume, 1};
    const auto picture = gpu().render(*renderer_, *metavoxels, draw, {});
    return picture ? std::string() : picture.error().message;
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<std::vector<Layer>> bad{
      {{nullptr}},           {{frame.get(), 1.5f}},    {{frame.get(), -0.1f}},
      {{frame.get(), kNan}}, {{frame.get(), 1, kNan}}, std::vector<Layer>(5, {frame.get(), 0.2f})};
  for (const std::vector<Layer>& layers : bad) {
    EXPECT_NE(messageOf({.layers = layers}).find("volumes[0].layers"), std::string::npos);
  }
  EXPECT_NE(messageOf({}).find("volumes[0].frame"), std::string::npos);
  EXPECT_NE(messageOf({.frame = frame.get(), .layers = bad[1]}).find("volumes[0].frame"), std::string::npos);
  const std::vector<Layer> one{{frame.get()}};
  EXPECT_NE(messageOf({.layers = one, .velocityScale = kNan}).find("volumes[0].velocityScale"), std::string::npos);
  EXPECT_EQ(messageOf({.layers = one, .velocityScale = 1e38f}), "");
  gpu().waitIdle();
}

// However far the numbers say that matter goes, it goes no further than what was binned.
TEST_F(MetavoxelLayers, AbsurdVelocitiesAreHarmless) {
  const format::Pack pack = openPack(movingCloudPack({.velocity = {3e30f, -2e37f, 1}}));
  const auto frame = uploadMoving(pack);
  const headless::Picture picture = draw({{frame.get(), 1, 1e30f}});
  for (const float value : picture.rgba) EXPECT_TRUE(std::isfinite(value));
}

}  // namespace
}  // namespace billow::tests
