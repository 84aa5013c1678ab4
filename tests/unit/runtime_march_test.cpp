// The march against mathematics: closed forms of homogeneous media, the mass that a picture must show, convergence.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "gpu_fixture.h"

namespace billow::tests {
namespace {

using runtime::Filter;
using runtime::Index;

constexpr double kPi = 3.14159265358979;
constexpr float kVoxel = 0.1f;  // world edge of a voxel in GridFrameBuilder's packs

// A box of 8^3 constant bricks of value 1 whose first voxel is (80, 80, 80): 64 voxels or 6.4 world units an edge.
std::vector<std::byte> slab() {
  return oneGridPack(0, [](GridFrameBuilder& grid) {
    for (std::uint32_t i = 0; i < 512; ++i) {
      grid.brick({10 + i / 64, 10 + i / 8 % 8, 10 + i % 8}, format::kEncodingConstant, {}, 1, 0, format::kMaskAll);
    }
  });
}
constexpr double kSlabCenter = (80 + 31.5) * 0.1;
constexpr double kSlabEdge = 6.4;

// A view along -z at the slab's middle.
runtime::DrawInfo lookAtSlab(const runtime::Frame& frame) {
  runtime::DrawInfo draw;
  draw.frame = &frame;
  draw.view = runtime::lookAt({kSlabCenter, kSlabCenter, 40}, {kSlabCenter, kSlabCenter, 0}, {0, 1, 0}, 6);
  draw.width = draw.height = 17;
  draw.colorFormat = runtime::ColorFormat::single;
  draw.look.ambient = {0, 0, 0};
  draw.look.albedo = {1, 1, 1};
  draw.look.anisotropy = 0;
  draw.look.extinctionScale = 0.4f;
  draw.sun.irradiance = {0, 0, 0};
  draw.quality = {.filter = Filter::nearest, .shadows = Filter::none};
  return draw;
}

class March : public GpuTest {
 protected:
  static headless::Picture render(runtime::Renderer& renderer, const runtime::DrawInfo& draw) {
    return valueOf(gpu().render(renderer, draw), "render");
  }
};

TEST_F(March, SlabTransmitsByBeerAndLambert) {
  const format::Pack pack = openPack(slab());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  const runtime::DrawInfo draw = lookAtSlab(*frame);
  const headless::Picture picture = render(*renderer, draw);
  for (std::uint32_t i = 0; i < picture.width * picture.height; ++i) {
    const auto offset = [&](std::uint32_t at) { return ((at + 0.5) / 17 * 2 - 1) * double{draw.view.tanHalfHeight}; };
    const double x = offset(i % 17), y = offset(i / 17);
    const double length = kSlabEdge * std::sqrt(1 + x * x + y * y);
    EXPECT_NEAR(picture.rgba[i * 4 + 3], 1 - std::exp(-0.4 * length), 2e-4) << "pixel " << i;
    EXPECT_EQ(picture.rgba[i * 4], 0) << "nothing lights it";
  }
}

TEST_F(March, AmbientLightFillsByOpacity) {
  const format::Pack pack = openPack(slab());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.look.ambient = {2, 1, 0.5f};
  draw.look.albedo = {0.5f, 1, 1};
  const headless::Picture picture = render(*renderer, draw);
  const float* middle = &picture.rgba[(8 * 17 + 8) * 4];
  const double opacity = 1 - std::exp(-0.4 * kSlabEdge);
  EXPECT_NEAR(middle[0], opacity, 2e-3);
  EXPECT_NEAR(middle[1], opacity, 2e-3);
  EXPECT_NEAR(middle[2], 0.5 * opacity, 1e-3);
}

TEST_F(March, SunBehindTheEyeMatchesTheClosedForm) {
  const format::Pack pack = openPack(slab());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.sun = {.direction = {0, 0, 1}, .irradiance = {1, 1, 1}};
  for (const Filter shadows : {Filter::none, Filter::nearest, Filter::trilinear}) {
    draw.quality.shadows = shadows;
    const float got = render(*renderer, draw).rgba[(8 * 17 + 8) * 4];
    // Isotropic single scattering: integral of s/(4 pi) e^(-s x) [e^(-s x)] over the depth x.
    const double once = 0.4 * kSlabEdge;
    const double expected =
        shadows == Filter::none ? (1 - std::exp(-once)) / (4 * kPi) : (1 - std::exp(-2 * once)) / (8 * kPi);
    EXPECT_NEAR(got / expected, 1, 0.01) << "shadows " << static_cast<int>(shadows);
  }
}

TEST_F(March, PhaseFunctionScattersForwardByHenyeyAndGreenstein) {
  const format::Pack pack = openPack(slab());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.look.anisotropy = 0.6f;
  draw.sun.irradiance = {1, 1, 1};
  const auto lit = [&](std::array<float, 3> direction) {
    draw.sun.direction = direction;
    return double{render(*renderer, draw).rgba[(8 * 17 + 8) * 4]};
  };
  // Towards the sun against away from it: ((1 + g) / (1 - g))^3.
  EXPECT_NEAR(lit({0, 0, -1}) / lit({0, 0, 1}), std::pow(1.6 / 0.4, 3), 0.5);
}

TEST_F(March, DepthIsWhereTheLightIsLost) {
  const format::Pack pack = openPack(slab());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.look.extinctionScale = 200;
  const headless::Picture picture = render(*renderer, draw);
  EXPECT_NEAR(picture.depth[8 * 17 + 8], 40 - kSlabCenter - kSlabEdge / 2, kVoxel);
}

TEST_F(March, BackgroundShowsThroughWhatIsLeft) {
  const format::Pack pack = openPack(slab());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.background = {.bottom = {3, 3, 3}, .top = {3, 3, 3}, .opacity = 1};
  const headless::Picture picture = render(*renderer, draw);
  EXPECT_NEAR(picture.rgba[(8 * 17 + 8) * 4], 3 * std::exp(-0.4 * kSlabEdge), 2e-3);
  EXPECT_EQ(picture.rgba[(8 * 17 + 8) * 4 + 3], 1);
}

TEST_F(March, HalfAndSingleImagesAgree) {
  const format::Pack pack = openPack(slab());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.look.ambient = {1, 1, 1};
  const headless::Picture single = render(*renderer, draw);
  draw.colorFormat = runtime::ColorFormat::half;
  const headless::Picture half = render(*renderer, draw);
  for (std::size_t i = 0; i < single.rgba.size(); ++i) ASSERT_NEAR(half.rgba[i], single.rgba[i], 1e-3);
}

// Homogeneous gas that burns: radiance e / s (1 - e^(-s L)) with the emission of a black body at the reference.
TEST_F(March, BurningSlabMatchesTheClosedForm) {
  const auto bytes = writePack({}, [](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", {"density", "flames"}, 1);
    for (int i = 0; i < 2; ++i) {
      GridFrameBuilder grid(writer, 0);
      for (std::uint32_t cell = 0; cell < 512; ++cell) {
        grid.brick({10 + cell / 64, 10 + cell / 8 % 8, 10 + cell % 8}, format::kEncodingConstant, {}, 1, 0,
                   format::kMaskAll);
      }
      tables.gridFrames.push_back(grid.finish(tables));
    }
    return tables;
  });
  const format::Pack pack = openPack(bytes);
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.look.emissionScale = 2;
  draw.look.temperatureScale = 0;
  draw.look.temperatureOffset = 1700;
  draw.look.referenceKelvin = 1700;
  const headless::Picture picture = render(*renderer, draw);
  const float* middle = &picture.rgba[(8 * 17 + 8) * 4];
  const double luminance = 0.2126 * double{middle[0]} + 0.7152 * double{middle[1]} + 0.0722 * double{middle[2]};
  EXPECT_NEAR(luminance, 2 / 0.4 * (1 - std::exp(-0.4 * kSlabEdge)), 0.02);
  EXPECT_GT(middle[0], middle[1]);
  EXPECT_GT(middle[1], middle[2]);
}

// A ball of radius 24 voxels around (130, 130, 130), one voxel in or out.
std::vector<std::byte> ball() {
  return oneGridPack(0, [](GridFrameBuilder& grid) {
    for (std::uint32_t cell = 0; cell < 512; ++cell) {
      const std::uint32_t at[3] = {12 + cell / 64, 12 + cell / 8 % 8, 12 + cell % 8};
      std::vector<std::byte> texels(512);
      bool any = false;
      for (std::uint32_t i = 0; i < 512; ++i) {
        const double x = at[0] * 8 + (i >> 6) - 130.0, y = at[1] * 8 + (i >> 3 & 7) - 130.0,
                     z = at[2] * 8 + (i & 7) - 130.0;
        if (x * x + y * y + z * z > 24 * 24) continue;
        texels[i] = std::byte{255};
        any = true;
      }
      if (any) grid.brick({at[0], at[1], at[2]}, format::kEncodingUniform8, texels, 0, 1.0f / 255, format::kMaskTexel);
    }
  });
}

TEST_F(March, BallTransmitsByItsChords) {
  const format::Pack pack = openPack(ball());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  draw.view = runtime::lookAt({13, 13, 213}, {13, 13, 0}, {0, 1, 0}, 1.6f);
  draw.width = draw.height = 41;
  draw.quality = {.filter = Filter::trilinear, .shadows = Filter::none, .step = 0.5f};
  const headless::Picture picture = render(*renderer, draw);
  double sum = 0, expectedSum = 0;
  for (std::uint32_t i = 0; i < 41 * 41; ++i) {
    const auto offset = [&](std::uint32_t at) {
      return ((at + 0.5) / 41 * 2 - 1) * double{draw.view.tanHalfHeight} * 200;
    };
    const double distance2 = std::pow(offset(i % 41), 2) + std::pow(offset(i / 41), 2);
    const double chord = 2 * std::sqrt(std::max(0.0, 2.4 * 2.4 - distance2));
    const double depth = -std::log(1 - double{picture.rgba[i * 4 + 3]});
    sum += depth;
    expectedSum += 0.4 * chord;
    // The ball's surface is off by up to a voxel at either end; at its rim a chord changes fast.
    if (distance2 < 2.0 * 2.0) {
      EXPECT_NEAR(depth, 0.4 * chord, 0.4 * 2.5 * double{kVoxel}) << "pixel " << i;
    }
  }
  EXPECT_NEAR(sum / expectedSum, 1, 0.01);
}

struct MassCase {
  Index index;
  Filter filter;
  bool affine;
};

class Mass : public March, public testing::WithParamInterface<MassCase> {};

constexpr double kShear[12] = {0.08, 0.03, -0.02, 4, -0.02, 0.1, 0.01, -3, 0.01, 0.02, 0.12, 7};

// Lone voxels and bricks far apart, with values that add up to `mass`.
std::vector<std::byte> scattered(bool affine, double& mass) {
  mass = 0;
  return writePack({}, [&](format::PackWriter& writer) {
    format::PackTables tables = sampleTables("v", {"density"}, 1);
    GridFrameBuilder grid(writer, 0);
    std::mt19937 random(11);
    for (std::uint32_t i = 0; i < 24; ++i) {
      std::vector<std::byte> texels(512);
      // Voxels at a brick's very corners and edges are those whose filter support reaches out of it.
      for (int k = 0; k < 6; ++k) {
        const auto corner = [&] { return static_cast<std::size_t>(random() % 2 * 7); };
        const std::size_t voxel = corner() + 8 * corner() + 64 * (k % 2 == 0 ? corner() : random() % 8);
        texels[voxel] = std::byte{static_cast<unsigned char>(100 + random() % 156)};
      }
      for (const std::byte texel : texels) mass += std::to_integer<int>(texel) / 255.0;
      const std::uint32_t slot = i * 7 % 24;  // apart, and in two Node4s
      grid.brick({14 + slot % 3 * 2, 14 + slot / 3 % 2 * 3, 14 + slot / 6 * 2}, format::kEncodingUniform8, texels, 0,
                 1.0f / 255, format::kMaskTexel);
    }
    tables.gridFrames.push_back(grid.finish(tables));
    if (affine) std::copy(std::begin(kShear), std::end(kShear), tables.gridFrames[0].indexToWorld);
    return tables;
  });
}

// Skipping must lose nothing: the optical depths of all pixels add up to the volume's mass, whatever the transform.
TEST_P(Mass, NothingIsSkippedThatCanBeSeen) {
  double mass = 0;
  const format::Pack pack = openPack(scattered(GetParam().affine, mass));
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack, 0, {.index = GetParam().index});
  const double* m = pack.gridFrames()[0].indexToWorld;
  std::array<double, 3> target;
  for (std::size_t i = 0; i < 3; ++i) target[i] = 136 * (m[i * 4] + m[i * 4 + 1] + m[i * 4 + 2]) + m[i * 4 + 3];
  const double determinant =
      m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  const double distance = 3000;
  draw.view = runtime::lookAt({target[0] + 0.48 * distance, target[1] + 0.6 * distance, target[2] + 0.64 * distance},
                              target, {0, 0, 1}, static_cast<float>(2 * std::atan(5.5 / distance) * 180 / kPi));
  draw.width = draw.height = 257;
  draw.look.extinctionScale = 0.01f;
  draw.quality = {.filter = GetParam().filter, .shadows = Filter::none, .step = 0.4f};
  const headless::Picture picture = render(*renderer, draw);
  double sum = 0;
  for (std::size_t i = 0; i < 257 * 257; ++i) sum -= std::log1p(-double{picture.rgba[i * 4 + 3]});
  const double pixel = 2 * distance * double{draw.view.tanHalfHeight} / 257;
  // A nearest read jumps at each voxel's face, which steps of half a pixel find but roughly.
  const double tolerance = GetParam().filter == Filter::nearest ? 0.05 : 0.02;
  EXPECT_NEAR(sum * pixel * pixel / (0.01 * mass * std::abs(determinant)), 1, tolerance);
}

INSTANTIATE_TEST_SUITE_P(
    All, Mass,
    testing::Values(MassCase{Index::flat, Filter::trilinear, false}, MassCase{Index::tree, Filter::trilinear, false},
                    MassCase{Index::dense, Filter::trilinear, false}, MassCase{Index::flat, Filter::nearest, false},
                    MassCase{Index::tree, Filter::nearest, false}, MassCase{Index::flat, Filter::trilinear, true},
                    MassCase{Index::tree, Filter::trilinear, true}));

TEST_F(March, HalvedStepsConverge) {
  const format::Pack pack = openPack(ball());
  const auto renderer = makeRenderer();
  const auto frame = upload(*renderer, pack);
  runtime::DrawInfo draw = lookAtSlab(*frame);
  // Pixels of a quarter of a voxel, below which no step goes.
  draw.view = runtime::lookAt({25, 29, 13}, {13, 13, 13}, {0, 0, 1}, 6);
  draw.width = draw.height = 96;
  const auto draws = [&](float step) {
    draw.quality = {.filter = Filter::trilinear, .shadows = Filter::none, .step = step};
    return render(*renderer, draw);
  };
  const headless::Picture fine = draws(0.25f);
  const auto error = [&](float step) {
    const headless::Picture picture = draws(step);
    double sum = 0;
    for (std::size_t i = 3; i < fine.rgba.size(); i += 4)
      sum += std::abs(double{picture.rgba[i]} - double{fine.rgba[i]});
    return sum;
  };
  const double coarse = error(4), halved = error(2), quartered = error(1);
  EXPECT_LT(halved, 0.7 * coarse);
  EXPECT_LT(quartered, 0.7 * halved);
}

}  // namespace
}  // namespace billow::tests
