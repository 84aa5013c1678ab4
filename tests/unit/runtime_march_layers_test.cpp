// The direct march of several layers.
#include <gtest/gtest.h>

#include "layers_fixture.h"
#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

using runtime::Layer;

class MarchLayers : public MetavoxelTest {
 protected:
  static runtime::DrawInfo cloudDraw() {
    runtime::DrawInfo draw;
    draw.view = runtime::lookAt({kMiddle + 3, kMiddle + 2, kMiddle + 16}, {kMiddle, kMiddle, kMiddle}, {0, 1, 0}, 20);
    draw.sun.direction = {0.3f, 1, 0.2f};
    draw.look.extinctionScale = 7.5f;
    draw.look.emissionScale = 4;
    draw.look.temperatureScale = 1500;
    draw.quality = {.step = 0.5f, .shadowStep = 1};
    draw.width = draw.height = 24;
    draw.colorFormat = runtime::ColorFormat::single;
    return draw;
  }
  std::unique_ptr<runtime::Frame> uploadMoving(const format::Pack& pack, runtime::Index index) {
    const format::VolumeRecord& volume = pack.volumes()[0];
    return upload(*renderer_, pack, 0,
                  {.grids = runtime::withVelocity(pack, volume, runtime::chooseGrids(pack, volume)), .index = index});
  }
  headless::Picture draw(runtime::DrawInfo draw, const std::vector<Layer>& layers) {
    draw.layers = layers;
    return valueOf(gpu().render(*renderer_, draw), "render");
  }
  headless::Picture draw(const std::vector<Layer>& layers) { return draw(cloudDraw(), layers); }
  headless::Picture drawFrame(const runtime::Frame& frame) {
    runtime::DrawInfo draw = cloudDraw();
    draw.frame = &frame;
    return valueOf(gpu().render(*renderer_, draw), "render");
  }
};

TEST_F(MarchLayers, WeightedPartsOfAFrameAreTheFrame) {
  for (const bool burning : {false, true}) {
    const format::Pack pack = openPack(movingCloudPack({.burning = burning, .velocity = {3, -2, 1}}));
    const format::Pack emptyPack = openPack(smallestPack());
    const auto empty = upload(*renderer_, emptyPack);
    for (const runtime::Index index : {runtime::Index::flat, runtime::Index::tree}) {
      const auto frame = uploadMoving(pack, index);
      const auto still = upload(*renderer_, pack, 0, {.index = index});
      const headless::Picture whole = drawFrame(*still);
      EXPECT_GT(*std::max_element(whole.rgba.begin(), whole.rgba.end()), 0.5f);
      EXPECT_EQ(drawFrame(*frame).rgba, whole.rgba);
      EXPECT_EQ(draw({{frame.get()}, {frame.get(), 0}, {empty.get(), 1}}).rgba, whole.rgba);
      EXPECT_EQ(draw({{frame.get(), 1, 0.3f}}).rgba, whole.rgba) << "nothing is carried";
      EXPECT_GT(pictureDecibels(whole, draw({{frame.get(), 0.3f}, {frame.get(), 0.7f}})), 90);
      EXPECT_GT(pictureDecibels(whole, draw({{frame.get(), 0.25f}, {still.get(), 0.25f}, {frame.get(), 0.5f}})), 90);
    }
    const headless::Picture none = draw({{empty.get()}, {empty.get(), 0}});
    EXPECT_EQ(*std::max_element(none.rgba.begin(), none.rgba.end()), 0);
  }
}

TEST_F(MarchLayers, ExtinctionIsLinearInTheWeights) {
  const format::Pack thinPack = openPack(slabPack(0.25f, 1)), coarsePack = openPack(slabPack(0.75f, 2));
  const auto thin = upload(*renderer_, thinPack), coarse = upload(*renderer_, coarsePack);
  runtime::DrawInfo info = cloudDraw();
  info.view = runtime::lookAt({kMiddle, kMiddle, kMiddle + 16}, {kMiddle, kMiddle, kMiddle}, {0, 1, 0}, 17);
  info.look.extinctionScale = 1.5f;
  info.width = info.height = 48;  // steps are no shorter than a pixel is wide
  for (const float weight : {0.0f, 0.25f, 0.6f, 1.0f}) {
    const headless::Picture picture = draw(info, {{thin.get(), 1 - weight}, {coarse.get(), weight}});
    const double depth = -std::log1p(-double{picture.rgba[(24 * 48 + 24) * 4 + 3]});
    EXPECT_NEAR(depth, 4.8 * (0.25 * (1 - double{weight}) + 0.75 * double{weight}), 0.01) << weight;
  }
}

TEST_F(MarchLayers, RefusesWhatIsNoLayer) {
  const format::Pack pack = openPack(movingCloudPack({.velocity = {3e30f, -2e37f, 1}}));
  const auto frame = uploadMoving(pack, runtime::Index::automatic);
  const auto messageOf = [&](const runtime::DrawInfo& draw) {
    const auto picture = gpu().render(*renderer_, draw);
    return picture ? std::string() : picture.error().message;
  };
  runtime::DrawInfo info = cloudDraw();
  const std::vector<std::vector<Layer>> bad{{{nullptr}}, {{frame.get(), -1}}, std::vector<Layer>(5, {frame.get()})};
  for (const std::vector<Layer>& layers : bad) {
    info.layers = layers;
    EXPECT_NE(messageOf(info).find("layers"), std::string::npos);
  }
  info.layers = {};
  EXPECT_NE(messageOf(info).find("frame"), std::string::npos);
  const std::vector<Layer> absurd{{frame.get(), 1, 1e30f}};
  info.layers = absurd;
  EXPECT_EQ(messageOf(info), "");
}

}  // namespace
}  // namespace billow::tests
