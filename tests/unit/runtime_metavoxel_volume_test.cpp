// VDB volumes in metavoxels: the direct march's picture, and company of particles.
#include <gtest/gtest.h>

#include "brick_corpus.h"
#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

using runtime::MetavoxelVolume;

constexpr std::uint32_t kDim = 48;
constexpr std::uint32_t kFirstCell = 10;
constexpr double kMiddle = (kFirstCell * 8 + (kDim - 1) / 2.0) * 0.1;  // world, of GridFrameBuilder's grids

// A noisy cloud of 48^3 voxels as grid "density", and where wanted its core as grid "flames".
std::vector<std::byte> cloudPack(bool burning) {
  const std::vector<std::string> names =
      burning ? std::vector<std::string>{"density", "flames"} : std::vector<std::string>{"density"};
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", names, 1);
    for (std::size_t number = 0; number < names.size(); ++number) {
      GridFrameBuilder grid(writer, 0);
      for (std::uint32_t cell = 0; cell < 216; ++cell) {
        const std::uint32_t at[3] = {cell / 36, cell / 6 % 6, cell % 6};
        std::vector<std::byte> texels(512);
        bool any = false;
        for (std::uint32_t i = 0; i < 512; ++i) {
          const float density = cloudDensity(kDim, at[0] * 8 + (i >> 6), at[1] * 8 + (i >> 3 & 7), at[2] * 8 + (i & 7));
          const float value = number == 0 ? density : std::max(density - 0.5f, 0.0f);
          texels[i] = static_cast<std::byte>(std::clamp(value * 255, 0.0f, 255.0f));
          any = any || texels[i] != std::byte{0};
        }
        if (!any) continue;
        grid.brick({kFirstCell + at[0], kFirstCell + at[1], kFirstCell + at[2]}, format::kEncodingUniform8, texels, 0,
                   1.0f / 255, format::kMaskTexel);
      }
      tables.gridFrames.push_back(grid.finish(tables));
    }
    return tables;
  });
}

runtime::Look cloudLook() {
  runtime::Look look;
  look.extinctionScale = 5;
  look.scatteringOrders = 3;
  look.emissionScale = 4;
  look.temperatureScale = 1500;
  return look;
}

MetavoxelDraw cloudDraw(const runtime::Look& look) {
  MetavoxelDraw draw = smallDraw();
  draw.center = {kMiddle, kMiddle, kMiddle};
  draw.view = runtime::lookAt({kMiddle + 3, kMiddle + 2, kMiddle + 16}, draw.center, {0, 1, 0}, 26);
  draw.width = draw.height = 64;
  draw.sun.direction = {0, 1, 0};
  draw.scattering = {.anisotropy = look.anisotropy, .ambient = look.ambient, .orders = look.scatteringOrders};
  return draw;
}

class MetavoxelVolumes : public MetavoxelTest {
 protected:
  headless::Picture renderDirect(const runtime::Frame& frame, const runtime::Look& look, const MetavoxelDraw& same) {
    runtime::DrawInfo draw;
    draw.frame = &frame;
    draw.view = same.view;
    draw.sun = same.sun;
    draw.look = look;
    draw.quality = {.step = 0.5f, .shadowStep = 0.5f, .shadowSteps = 200};
    draw.width = same.width;
    draw.height = same.height;
    draw.colorFormat = same.colorFormat;
    return valueOf(gpu().render(*renderer_, draw), "direct");
  }
};

TEST_F(MetavoxelVolumes, DirectMarchAgreesAtEqualVoxelSize) {
  for (const bool burning : {false, true}) {
    const format::Pack pack = openPack(cloudPack(burning));
    for (const runtime::Index index : {runtime::Index::flat, runtime::Index::tree}) {
      const auto frame = upload(*renderer_, pack, 0, {.index = index});
      const runtime::Look look = cloudLook();
      MetavoxelDraw draw = cloudDraw(look);
      const std::vector<MetavoxelVolume> volumes{{.frame = frame.get(), .look = look}};
      draw.volumes = volumes;
      draw.step = 0.5f;
      const headless::Picture metavoxel = renderOnce(smallConfig(), draw);
      const headless::Picture direct = renderDirect(*frame, look, draw);
      EXPECT_GT(pictureDecibels(direct, metavoxel), 45) << (burning ? "burning" : "smoke");
      EXPECT_GT(*std::max_element(direct.rgba.begin(), direct.rgba.end()), 0.9f);
      for (std::size_t i = 0; i < direct.depth.size(); ++i) {
        if (direct.rgba[i * 4 + 3] < 0.05f) continue;
        EXPECT_NEAR(direct.depth[i], metavoxel.depth[i], 0.05f);
      }
    }
  }
}

TEST_F(MetavoxelVolumes, CoarseVoxelsTakeTheMean) {
  const format::Pack pack = openPack(cloudPack(false));
  const auto frame = upload(*renderer_, pack);
  const runtime::Look look = cloudLook();
  MetavoxelDraw draw = cloudDraw(look);
  const std::vector<MetavoxelVolume> volumes{{.frame = frame.get(), .look = look}};
  draw.volumes = volumes;
  const headless::Picture fine = renderOnce(smallConfig(), draw);
  draw.voxelSize = 0.3f;
  draw.step = 1.0f / 3;
  const headless::Picture coarse = renderOnce(smallConfig(), draw);
  EXPECT_GT(pictureDecibels(fine, coarse), 26);
  // What is lost in sharpness is not lost in amount.
  const auto amount = [](const headless::Picture& picture) {
    double sum = 0;
    for (std::size_t i = 3; i < picture.rgba.size(); i += 4) sum -= std::log1p(-double{picture.rgba[i]});
    return sum;
  };
  EXPECT_NEAR(amount(coarse) / amount(fine), 1, 0.02);
}

TEST_F(MetavoxelVolumes, ObjectsAreWhereTheirTransformPutsThem) {
  const format::Pack pack = openPack(cloudPack(true));
  const auto frame = upload(*renderer_, pack);
  const runtime::Look look = cloudLook();
  MetavoxelDraw draw = cloudDraw(look);
  std::vector<MetavoxelVolume> volumes{{.frame = frame.get(), .look = look}};
  draw.volumes = volumes;
  const headless::Picture still = renderOnce(smallConfig(), draw);
  // The cloud a quarter turn around y through its middle, and everything else with it: x to -z, z to x.
  const auto turned = [](const std::array<double, 3>& v) { return std::array<double, 3>{v[2], v[1], -v[0]}; };
  volumes[0].objectToWorld = {0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 2 * kMiddle};
  draw.volumes = volumes;
  const auto side = turned({3, 2, 16});
  draw.view = runtime::lookAt({kMiddle + side[0], kMiddle + side[1], kMiddle + side[2]}, draw.center, {0, 1, 0}, 26);
  const headless::Picture moved = renderOnce(smallConfig(), draw);
  EXPECT_GT(pictureDecibels(still, moved), 45);
}

TEST_F(MetavoxelVolumes, VolumesAndParticlesShadowEachOther) {
  const format::Pack pack = openPack(cloudPack(false));
  const auto frame = upload(*renderer_, pack);
  const runtime::Look look = cloudLook();
  MetavoxelDraw draw = cloudDraw(look);
  draw.scattering.ambient = {0, 0, 0};
  // A voxel is 0.7 pixels, the cloud at most rows 15 to 49.
  draw.view = runtime::lookAt({kMiddle, kMiddle, kMiddle + 20}, draw.center, {0, 1, 0}, 26);
  const auto metavoxels = make(smallConfig());
  const std::vector<MetavoxelVolume> volumes{{.frame = frame.get(), .look = look}};
  constexpr auto kAt = static_cast<float>(kMiddle);
  const std::vector<Particle> above{ball({kAt, kAt + 3.4f, kAt}, 0.9f, 6)};
  const std::vector<Particle> below{ball({kAt, kAt - 3.4f, kAt}, 0.9f, 6)};
  // Radiance of rows of the picture, where the balls are in front of or behind the cloud on the light's way.
  const auto light = [&](bool cloud, std::span<const Particle> particles, std::size_t first, std::size_t last) {
    draw.volumes = cloud ? std::span<const MetavoxelVolume>(volumes) : std::span<const MetavoxelVolume>();
    draw.particles = particles;
    const headless::Picture picture = render(*metavoxels, draw);
    double sum = 0;
    for (std::size_t row = first; row < last; ++row) {
      for (std::size_t column = 28; column < 36; ++column) sum += double{picture.rgba[(row * 64 + column) * 4]};
    }
    return sum;
  };
  EXPECT_LT(light(true, below, 50, 64), 0.5 * light(false, below, 50, 64)) << "the cloud shadows the ball";
  EXPECT_LT(light(true, above, 15, 49), 0.9 * light(true, {}, 15, 49)) << "the ball shadows the cloud";
  EXPECT_NEAR(light(true, above, 0, 14) / light(false, above, 0, 14), 1, 0.02) << "nothing shadows the ball";
}

TEST_F(MetavoxelVolumes, TwoVolumesAdd) {
  const format::Pack pack = openPack(cloudPack(false));
  const auto frame = upload(*renderer_, pack);
  runtime::Look thin = cloudLook(), dense = cloudLook();
  thin.extinctionScale = 2;
  dense.extinctionScale = 3;
  MetavoxelDraw draw = cloudDraw(thin);
  const std::vector<MetavoxelVolume> two{{.frame = frame.get(), .look = thin}, {.frame = frame.get(), .look = dense}};
  draw.volumes = two;
  const headless::Picture sum = renderOnce(smallConfig(), draw);
  const std::vector<MetavoxelVolume> one{{.frame = frame.get(), .look = cloudLook()}};
  draw.volumes = one;
  const headless::Picture whole = renderOnce(smallConfig(), draw);
  EXPECT_GT(pictureDecibels(whole, sum), 60);
}

TEST_F(MetavoxelVolumes, WeightedColoursAreMeans) {
  const format::Pack pack = openPack(cloudPack(false));
  const auto frame = upload(*renderer_, pack);
  runtime::Look red = cloudLook(), green = cloudLook();
  red.extinctionScale = 3;
  red.albedo = {0.8f, 0, 0};
  green.extinctionScale = 1;
  green.albedo = {0, 0.8f, 0};
  MetavoxelDraw draw = cloudDraw(red);
  draw.sun.irradiance = {0, 0, 0};
  draw.scattering.ambient = {1, 1, 1};
  draw.blend = runtime::Blend::weighted;
  const std::vector<MetavoxelVolume> two{{.frame = frame.get(), .look = red}, {.frame = frame.get(), .look = green}};
  draw.volumes = two;
  const headless::Picture picture = renderOnce(smallConfig(), draw);
  int seen = 0;
  for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
    if (picture.rgba[i + 3] < 0.1f) continue;
    ++seen;
    EXPECT_NEAR(picture.rgba[i] / picture.rgba[i + 3], 0.6, 2e-3);
    EXPECT_NEAR(picture.rgba[i + 1] / picture.rgba[i + 3], 0.2, 2e-3);
  }
  EXPECT_GT(seen, 500);
}

// In the same metavoxels, and in the same blocks of them: each adds its depth to the shadow.
TEST_F(MetavoxelVolumes, VolumeAndParticlesAddUpInTheShadow) {
  const format::Pack pack = openPack(cloudPack(false));
  const auto frame = upload(*renderer_, pack);
  const runtime::Look look = cloudLook();
  const std::vector<MetavoxelVolume> volumes{{.frame = frame.get(), .look = look}};
  std::vector<Particle> particles;
  for (int i = 0; i < 64; ++i) {
    const double at[3] = {(i % 4 - 1.5) * 0.8, (i / 4 % 4 - 1.5) * 0.8, (i / 16 - 1.5) * 0.8};
    const auto place = [&](std::size_t axis) { return static_cast<float>(kMiddle + at[axis]); };
    particles.push_back(ball({place(0), place(1), place(2)}, 0.7f, 0.5f));
  }
  const auto metavoxels = make(smallConfig());
  const auto shadow = [&](bool cloud, bool puffs) {
    MetavoxelDraw draw = cloudDraw(look);
    draw.cull = false;
    if (cloud) draw.volumes = volumes;
    if (puffs) draw.particles = particles;
    render(*metavoxels, draw);
    return valueOf(gpu().readShadow(*renderer_, *metavoxels), "shadow");
  };
  const std::vector<float> cloud = shadow(true, false), puffs = shadow(false, true);
  EXPECT_GT(*std::max_element(cloud.begin(), cloud.end()), 1.0f);
  EXPECT_GT(*std::max_element(puffs.begin(), puffs.end()), 0.5f);
  for (int again = 0; again < 4; ++again) {
    const std::vector<float> both = shadow(true, true);
    for (std::size_t i = 0; i < both.size(); ++i) {
      ASSERT_NEAR(both[i], cloud[i] + puffs[i], 2e-3f * (1 + both[i])) << i;
    }
  }
}

}  // namespace
}  // namespace billow::tests
