// What a picture without any options looks like: it must not depend on units, and fire must look like fire.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "billow/runtime/look.h"
#include "gpu_fixture.h"

namespace billow::tests {
namespace {

// A cube of noise, 4^3 bricks; `value` scales what the grids hold, `world` the size of a voxel.
std::vector<std::byte> cloud(const std::vector<std::string>& grids, float value, double world) {
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", grids, 1);
    for (std::uint32_t g = 0; g < grids.size(); ++g) {
      if (grids[g] == "temperature") {
        tables.grids[g].role = static_cast<std::uint32_t>(format::Role::temperature);
      }
      GridFrameBuilder grid(writer, 0);
      for (std::uint32_t i = 0; i < 64; ++i) {
        grid.brick({20 + i / 16, 20 + i / 4 % 4, 20 + i % 4}, format::kEncodingUniform8, randomBytes(512, i), 0,
                   value / 255, format::kMaskAll);
      }
      tables.gridFrames.push_back(grid.finish(tables));
      for (double& entry : tables.gridFrames.back().indexToWorld) entry *= world;
    }
    return tables;
  });
}

class LookTest : public GpuTest {
 protected:
  static headless::Picture picture(const format::Pack& pack, bool night = false) {
    const format::VolumeRecord& volume = pack.volumes()[0];
    const runtime::GridChoice grids = runtime::chooseGrids(pack, volume);
    const runtime::WorldBox box = runtime::worldBox(pack, volume, grids, 0, 0);
    const auto renderer = makeRenderer();
    const auto frame = upload(*renderer, pack);
    runtime::DrawInfo draw;
    draw.frame = frame.get();
    draw.look = valueOf(runtime::suggestLook(pack, volume, grids), "the look");
    if (night) {
      draw.sun.irradiance = {0, 0, 0};
      draw.look.ambient = {0, 0, 0};
    }
    std::array<double, 3> center, eye;
    for (std::size_t i = 0; i < 3; ++i) {
      center[i] = (box.min[i] + box.max[i]) / 2;
      eye[i] = center[i] + (box.max[0] - box.min[0]) * (i == 1 ? -2.5 : 0.5);
    }
    draw.view = runtime::lookAt(eye, center, {0, 0, 1}, 35);
    draw.width = draw.height = 24;
    draw.colorFormat = runtime::ColorFormat::single;
    draw.quality.shadows = runtime::Filter::nearest;
    return valueOf(gpu().render(*renderer, draw), "render");
  }
  static const float* middle(const headless::Picture& picture) { return &picture.rgba[(12 * 24 + 12) * 4]; }
};

TEST_F(LookTest, SmokeLooksTheSameInAnyUnits) {
  const headless::Picture one = picture(openPack(cloud({"density"}, 1, 1)));
  const headless::Picture other = picture(openPack(cloud({"density"}, 64, 1024)));
  ASSERT_EQ(one.rgba.size(), other.rgba.size());
  for (std::size_t i = 0; i < one.rgba.size(); ++i) ASSERT_NEAR(one.rgba[i], other.rgba[i], 2e-3) << i;
  EXPECT_GT(middle(one)[3], 0.9f) << "a cloud hides what is behind it";
}

TEST_F(LookTest, SmokeIsGrey) {
  const headless::Picture smoke = picture(openPack(cloud({"density"}, 1, 1)));
  const float* pixel = middle(smoke);
  EXPECT_LT(*std::max_element(pixel, pixel + 3), 1.5f * *std::min_element(pixel, pixel + 3));
}

TEST_F(LookTest, FireGlowsWarmWithAndWithoutADensityGrid) {
  using Names = std::vector<std::string>;
  for (const Names& grids :
       {Names{"density", "flames"}, Names{"flames", "temperature"}, Names{"temperature"}, Names{"flames"}}) {
    const headless::Picture fire = picture(openPack(cloud(grids, 1, 1)), true);
    const float* pixel = middle(fire);
    EXPECT_GT(pixel[0], 1.3f * pixel[1]) << grids.front();
    EXPECT_GT(pixel[1], 1.3f * pixel[2]) << grids.front();
    EXPECT_GT(pixel[0], 0.3f) << grids.front();
    EXPECT_GT(pixel[3], 0.2f) << grids.front() << ": there is smoke too";
  }
}

TEST_F(LookTest, ThePacksOwnLookIsTaken) {
  const format::Pack pack = openPack(samplePack());
  const format::VolumeRecord& volume = pack.volumes()[0];
  const auto look = valueOf(runtime::suggestLook(pack, volume, runtime::chooseGrids(pack, volume)), "the look");
  EXPECT_EQ(look.extinctionScale, 2);
  EXPECT_EQ(look.anisotropy, 0.5f);
}

}  // namespace
}  // namespace billow::tests
