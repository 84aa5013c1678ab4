// The scene's shadow on the volume, and what is left of the volume's on the scene.
#include <gtest/gtest.h>

#include <limits>

#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

// A shadow map under a sun straight above: the height of the scene at (x, z), turned and at any resolution.
struct ShadowMap {
  double pitch = 0.1;  // world units a texel
  double turn = 0.4;   // radians
  std::uint32_t size = 0;

  std::unique_ptr<headless::SceneImage> image = nullptr;
  runtime::SceneShadow shadow = {};

  // Value of a surface at y: 50 - y.
  template <class Height>
  void fill(headless::Headless& gpu, const Height& height) {
    size = static_cast<std::uint32_t>(std::ceil(14 / pitch));
    const double cosine = std::cos(turn), sine = std::sin(turn), middle = 0.5 * size;
    std::vector<float> texels(std::size_t{size} * size);
    for (std::size_t i = 0; i < texels.size(); ++i) {
      const double u = (static_cast<double>(i % size) + 0.5 - middle) * pitch;
      const double v = (static_cast<double>(i / size) + 0.5 - middle) * pitch;
      texels[i] = 50 - static_cast<float>(height(cosine * u - sine * v, sine * u + cosine * v));
    }
    image = valueOf(gpu.sceneImage(size, size, texels), "the shadow map");
    shadow.view = image->view();
    shadow.worldToMap = {
        cosine / pitch, 0, sine / pitch, middle, -sine / pitch, 0, cosine / pitch, middle, 0, -1, 0, 50};
  }
};

// Fog of extinction 5/32, a 64th a voxel, between y = -1.65 and 1.65, as wide, and `depth` deep.
std::vector<Particle> fog(float depth) {
  Particle box = ball({0, 0, 0}, 3, 0.15625f, kHard);
  box.kind = format::kKindBox;
  const float sides[3] = {1.65f, 1.65f, depth};
  std::copy(sides, sides + 3, box.shape);
  return {box};
}
constexpr double kExtinction = 0.15625, kTop = 1.65;

class MetavoxelScene : public MetavoxelTest {
 protected:
  static MetavoxelDraw sunnyDraw() {
    MetavoxelDraw draw = smallDraw();
    draw.sun = {.direction = {0, 1, 0}, .irradiance = {8, 8, 8}};
    draw.scattering = {.anisotropy = 0, .ambient = {0, 0, 0}, .orders = 1};
    return draw;
  }

  // The volume's shadow under a scene, and what the columns at (x, z) of it are. The columns' middles lie at multiples
  // of 0.1.
  template <class See>
  void eachColumn(runtime::Metavoxels& metavoxels, const MetavoxelDraw& draw, double reach, const See& see) {
    render(metavoxels, draw);
    const runtime::MetavoxelShadow image = metavoxels.shadow();
    const std::vector<float> shadow = valueOf(gpu().readShadow(*renderer_, metavoxels), "shadow");
    const int steps = static_cast<int>(std::lround(reach * 10));
    for (int i = -steps; i <= steps; ++i) {
      for (int k = -steps; k <= steps; ++k) {
        const double x = i * 0.1, z = k * 0.1;
        std::size_t texel[2];
        for (std::size_t row = 0; row < 2; ++row) {
          const auto& r = image.toTexel[row];
          texel[row] = static_cast<std::size_t>(r[0] * x + r[2] * z + r[3]);
        }
        see(x, z, double{shadow[texel[1] * image.size + texel[0]]});
      }
    }
  }
};

TEST_F(MetavoxelScene, CastersGetTheLightThatReachedThem) {
  // A slope, whose surface lies anywhere within voxels, under maps from 8 texels a voxel to 9 voxels a texel.
  const auto slope = [](double x, double z) { return 0.17 + 0.5 * x - 0.2 * z; };
  MetavoxelDraw draw = sunnyDraw();
  const std::vector<Particle> particles = fog(1.65f);
  draw.particles = particles;
  const auto metavoxels = make(smallConfig());
  for (const double pitch : {0.0127, 0.23, 0.9}) {
    ShadowMap map{.pitch = pitch};
    map.fill(gpu(), slope);
    draw.sceneShadow = map.shadow;
    eachColumn(*metavoxels, draw, 1.5, [&](double x, double z, double shadow) {
      EXPECT_NEAR(shadow, kExtinction * (kTop - slope(x, z)), 2e-4) << pitch << ": " << x << ' ' << z;
    });
  }
}

TEST_F(MetavoxelScene, SilhouettesHaveNoCracks) {
  // A disc over a floor. What is beside its edge by more than a voxel and half a texel is as if there were no edge; in
  // between there is nothing that is neither.
  constexpr double kRadius = 1.03, kDisc = 0.83, kFloor = -1.1;
  const auto scene = [](double x, double z) { return std::hypot(x, z) < kRadius ? kDisc : kFloor; };
  MetavoxelDraw draw = sunnyDraw();
  const std::vector<Particle> particles = fog(1.65f);
  draw.particles = particles;
  const auto metavoxels = make(smallConfig());
  for (const double pitch : {0.0127, 0.1, 0.3}) {
    ShadowMap map{.pitch = pitch};
    map.fill(gpu(), scene);
    draw.sceneShadow = map.shadow;
    double area = 0, roughness = 0;
    int between = 0;
    eachColumn(*metavoxels, draw, 1.5, [&](double x, double z, double shadow) {
      const double lit = kExtinction * (kTop - kDisc), floor = kExtinction * (kTop - kFloor);
      const double edge = std::hypot(x, z) - kRadius;
      EXPECT_GT(shadow, lit - 2e-4);
      EXPECT_LT(shadow, floor + 2e-4);
      if (std::abs(edge) > 0.08 + 0.75 * pitch) {
        EXPECT_NEAR(shadow, edge < 0 ? lit : floor, 2e-4) << pitch << ": " << x << ' ' << z;
      }
      const double share = (floor - shadow) / (floor - lit);
      area += share * 0.01;
      between += share > 0.02 && share < 0.98 ? 1 : 0;
      if (pitch < 0.2) roughness = std::max(roughness, std::abs(share - std::clamp(0.5 - edge / 0.13, 0.0, 1.0)));
    });
    EXPECT_NEAR(area / (3.14159265 * kRadius * kRadius), 1, 0.04) << pitch;
    EXPECT_GT(between, 40) << "the edge is resolved within voxels, pitch " << pitch;
    EXPECT_LT(roughness, pitch < 0.05 ? 0.2 : 0.55) << "pitch " << pitch;
  }
}

TEST_F(MetavoxelScene, BehindCastersThereIsNoSun) {
  // A thin sheet of fog seen from the front, and a plate at y = 0.83 over all x < 0.4.
  constexpr double kEdge = 0.4, kPlate = 0.53;
  MetavoxelDraw draw = sunnyDraw();
  draw.view = runtime::lookAt({0, 0, 60}, {0, 0, 0}, {0, 1, 0}, 3);
  draw.width = draw.height = 64;
  const std::vector<Particle> particles = fog(0.35f);
  draw.particles = particles;
  const auto metavoxels = make(smallConfig());
  const headless::Picture open = render(*metavoxels, draw);
  const double pixel = 2 * 60 * double{draw.view.tanHalfHeight} / 64;
  for (const double pitch : {0.0127, 0.5}) {
    ShadowMap map{.pitch = pitch, .turn = 0};
    map.fill(gpu(), [&](double x, double) { return x < kEdge ? kPlate : double{-kNothing}; });
    draw.sceneShadow = map.shadow;
    const headless::Picture picture = render(*metavoxels, draw);
    for (std::uint32_t i = 0; i < 64 * 64; ++i) {
      const double x = (i % 64 - 31.5) * pixel, y = (31.5 - i / 64) * pixel;
      const float expected = open.rgba[i * 4];
      EXPECT_EQ(picture.rgba[i * 4 + 3], open.rgba[i * 4 + 3]) << "opacity has no light";
      EXPECT_LE(picture.rgba[i * 4], expected * 1.001f + 1e-6f);
      EXPECT_GE(picture.rgba[i * 4], -1e-6f);
      if (y > kPlate + 0.25 || x > kEdge + 0.25 + pitch / 2) {
        EXPECT_NEAR(picture.rgba[i * 4], expected, 1e-3f * expected) << pitch << ": " << x << ' ' << y;
      } else if (y < kPlate - 0.25 && x < kEdge - 0.25 - pitch / 2) {
        EXPECT_LT(picture.rgba[i * 4], 1e-6f) << pitch << ": " << x << ' ' << y;
      }
    }
    // Ambient light is not the sun's.
    draw.scattering.ambient = {0.5f, 0.5f, 0.5f};
    EXPECT_GT(render(*metavoxels, draw).rgba[(50 * 64 + 10) * 4], 0.01f);
    draw.scattering.ambient = {0, 0, 0};
  }
}

TEST_F(MetavoxelScene, OutsideOfTheMapNothingIsShadowed) {
  MetavoxelDraw draw = sunnyDraw();
  const std::vector<Particle> particles = fog(1.65f);
  draw.particles = particles;
  const auto metavoxels = make(smallConfig());
  ShadowMap map{.pitch = 0.1};
  map.fill(gpu(), [](double, double) { return 1.0; });
  draw.sceneShadow = map.shadow;
  draw.sceneShadow.worldToMap[3] -= 70 + 1e9;  // far away
  eachColumn(*metavoxels, draw, 1.5,
             [](double, double, double shadow) { EXPECT_NEAR(shadow, 2 * kTop * kExtinction, 2e-4); });
  draw.sceneShadow.worldToMap[3] += 1e9;  // its left half lies on the space
  draw.sceneShadow.worldToMap[0] = 10;
  draw.sceneShadow.worldToMap[2] = 0;
  eachColumn(*metavoxels, draw, 1.5, [&](double x, double, double shadow) {
    if (std::abs(x) < 0.15) return;
    EXPECT_NEAR(shadow, kExtinction * (x > 0 ? kTop - 1 : 2 * kTop), 2e-4) << x;
  });
  // What the host cleared its map to is no surface.
  draw.sceneShadow.empty = 49;
  eachColumn(*metavoxels, draw, 1.5,
             [](double, double, double shadow) { EXPECT_NEAR(shadow, 2 * kTop * kExtinction, 2e-4); });
}

TEST_F(MetavoxelScene, SmallPoolDrawsTheSamePicture) {
  std::vector<Particle> particles{ball({0, 0, 0}, 2.2f, 1.2f), ball({1.6f, 0.9f, -0.4f}, 1.5f, 2),
                                  ball({-1.7f, 1.4f, 0.6f}, 1.4f, 3), ball({-0.9f, -1.8f, 1.3f}, 1.2f, 1.5f)};
  MetavoxelDraw draw = sunnyDraw();
  draw.particles = particles;
  draw.cull = false;
  ShadowMap map{.pitch = 0.07};
  map.fill(gpu(), [](double x, double z) { return std::sin(x * 2) + std::cos(z * 3) > 0.3 ? 0.5 + 0.3 * x : -1.4; });
  draw.sceneShadow = map.shadow;
  const auto whole = make(smallConfig());
  MetavoxelConfig little = smallConfig();
  little.maxMetavoxels = 700;
  little.memoryBudget = 1'060'000;
  const auto rounds = make(little);
  for (const auto& eye : {std::array<double, 3>{3, 2, 16}, {-9, -8, -3}, {4, 8, 8}, {0.4, 0.3, 2.9}}) {
    draw.view = runtime::lookAt(eye, {0.1, 0.2, 0}, {0, 1, 0}, 50);
    const headless::Picture expected = render(*whole, draw);
    const headless::Picture picture = render(*rounds, draw);
    EXPECT_GE(rounds->stats().drawn, 7 * rounds->poolSlots());
    EXPECT_LT(largestDifference(expected, picture), 3e-3f);
    EXPECT_GT(pictureDecibels(expected, picture), 65);
    const std::vector<float> a = valueOf(gpu().readShadow(*renderer_, *whole), "shadow");
    const std::vector<float> b = valueOf(gpu().readShadow(*renderer_, *rounds), "shadow");
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-4f) << i;
  }
}

TEST_F(MetavoxelScene, MapThatIsNotAlongTheLightIsRefused) {
  MetavoxelDraw draw = sunnyDraw();
  ShadowMap map{.pitch = 0.5};
  map.fill(gpu(), [](double, double) { return 0.0; });
  const auto metavoxels = make(smallConfig());
  const auto refused = [&](auto change) {
    draw.sceneShadow = map.shadow;
    change(draw.sceneShadow.worldToMap);
    const auto drawn = gpu().render(*renderer_, *metavoxels, draw, {});
    return !drawn && drawn.error().message.find("sceneShadow.worldToMap") != std::string::npos;
  };
  EXPECT_TRUE(refused([](auto& m) { m[1] = 0.1; })) << "texels change along the light";
  EXPECT_TRUE(refused([](auto& m) { m[9] = 0; })) << "depth does not";
  EXPECT_TRUE(refused([](auto& m) { m[4] = m[6] = 0; }));
  EXPECT_TRUE(refused([](auto& m) { m[3] = std::nan(""); }));
  EXPECT_FALSE(refused([](auto& m) { m[8] = 0.5; })) << "depth may be aslant";
}

}  // namespace
}  // namespace billow::tests
