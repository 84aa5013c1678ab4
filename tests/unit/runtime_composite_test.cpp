// Pictures of half the resolution laid over a scene, against those drawn at its own.
#include "billow/runtime/composite.h"

#include <gtest/gtest.h>

#include <limits>

#include "metavoxel_fixture.h"

namespace billow::tests {
namespace {

constexpr std::uint32_t kSize = 96;
constexpr float kSky = std::numeric_limits<float>::infinity();

// A sphere of radius 1.2 in the middle, and a thin upright wire left of it, before the sky or a wall.
std::vector<float> sceneDepths(const runtime::View& view, std::uint32_t size, float wall) {
  std::vector<float> depths(std::size_t{size} * size);
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const double across[2] = {(static_cast<double>(i % size) + 0.5) / size * 2 - 1,
                              1 - (static_cast<double>(i / size) + 0.5) / size * 2};
    double ray[3], along = 0, apart = 0, square = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      ray[k] = double{view.forward[k]} +
               double{view.tanHalfHeight} * (across[0] * double{view.right[k]} + across[1] * double{view.up[k]});
      along -= ray[k] * view.eye[k];
      apart += view.eye[k] * view.eye[k];
      square += ray[k] * ray[k];
    }
    const double root = along * along - square * (apart - 1.2 * 1.2);
    depths[i] = root > 0 ? static_cast<float>((along - std::sqrt(root)) / square) : wall;
    if (std::abs(across[0] + 0.7) < 0.011) depths[i] = 15;
  }
  return depths;
}

class Composite : public MetavoxelTest {
 protected:
  void SetUp() override {
    MetavoxelTest::SetUp();
    compositor_ = valueOf(runtime::Compositor::create(*renderer_, 2), "the compositor");
    draw_ = smallDraw();
    draw_.view = runtime::lookAt({0, 0, 16}, {0, 0, 0}, {0, 1, 0}, 22);
    draw_.sun.direction = {-0.3f, 0.9f, 0.3f};
    draw_.scattering.ambient = {0.6f, 0.6f, 0.6f};
    metavoxels_ = make(smallConfig());
  }
  void TearDown() override {
    gpu().waitIdle();
    compositor_.reset();
    metavoxels_.reset();
    MetavoxelTest::TearDown();
  }

  headless::Picture renderAt(std::uint32_t size, float wall) {
    draw_.width = draw_.height = size;
    // A jitterless march's steps are the same at any resolution.
    return render(*metavoxels_, draw_, sceneDepths(draw_.view, size, wall));
  }

  // The picture over `behind`, by the compositor. `marched` is the depth that it was marched to, or empty.
  std::vector<float> composite(const headless::Picture& picture, std::span<const float> marched,
                               std::span<const float> behind, std::span<const float> depths) {
    const auto image = [&](std::uint32_t size, std::span<const float> texels) {
      return valueOf(gpu().sceneImage(size, size, texels), "an image");
    };
    const auto color = image(picture.width, picture.rgba), depth = image(picture.width, picture.depth);
    const auto target = image(kSize, behind), targetDepth = image(kSize, depths);
    const auto scene = marched.empty() ? nullptr : image(picture.width, marched);
    const runtime::CompositeDraw draw{.width = picture.width,
                                      .height = picture.height,
                                      .colorFormat = runtime::ColorFormat::single,
                                      .color = color->view(),
                                      .depth = depth->view(),
                                      .sceneDepth = scene ? scene->view() : VK_NULL_HANDLE,
                                      .targetWidth = kSize,
                                      .targetHeight = kSize,
                                      .targetFormat = runtime::ColorFormat::single,
                                      .target = target->view(),
                                      .targetDepth = targetDepth->view()};
    const auto done = gpu().run([&](VkCommandBuffer commands) { return compositor_->record(commands, draw); });
    EXPECT_TRUE(done) << (done ? "" : done.error().message);
    return valueOf(gpu().read(*target), "the target");
  }

  std::unique_ptr<runtime::Compositor> compositor_;
  std::unique_ptr<runtime::Metavoxels> metavoxels_;
  MetavoxelDraw draw_;
};

// A scene's own colours: what the picture lets through must be there in the right amount.
std::vector<float> sceneColours() {
  std::vector<float> colours(std::size_t{kSize} * kSize * 4, 1);
  for (std::size_t i = 0; i < colours.size(); i += 4) {
    const std::size_t x = i / 4 % kSize, y = i / 4 / kSize;
    colours[i] = (x / 4 + y / 4) % 2 == 0 ? 0.9f : 0.1f;
    colours[i + 1] = 0.3f;
  }
  return colours;
}

std::vector<float> over(std::span<const float> picture, std::span<const float> behind) {
  std::vector<float> result(behind.begin(), behind.end());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = picture[i] + (1 - picture[i | 3]) * behind[i];
  return result;
}

// What plain bilinear filtering makes of a picture.
std::vector<float> bilinear(const headless::Picture& picture) {
  std::vector<float> result(std::size_t{kSize} * kSize * 4);
  const auto size = static_cast<int>(picture.width);
  for (std::size_t i = 0; i < result.size() / 4; ++i) {
    const double x = (static_cast<double>(i % kSize) + 0.5) * size / kSize - 0.5;
    const double y = (static_cast<double>(i / kSize) + 0.5) * size / kSize - 0.5;
    for (int corner = 0; corner < 4; ++corner) {
      const double at[2] = {std::floor(x) + (corner & 1), std::floor(y) + (corner >> 1)};
      const auto weight = static_cast<float>((1 - std::abs(at[0] - x)) * (1 - std::abs(at[1] - y)));
      const auto texel = [&](double v) {
        return static_cast<std::size_t>(std::clamp(static_cast<int>(v), 0, size - 1));
      };
      const float* from = &picture.rgba[(texel(at[1]) * picture.width + texel(at[0])) * 4];
      for (std::size_t c = 0; c < 4; ++c) result[i * 4 + c] += weight * from[c];
    }
  }
  return result;
}

double largest(std::span<const float> a, std::span<const float> b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(double{a[i]} - double{b[i]}));
  return most;
}

TEST_F(Composite, SilhouettesHaveNoCracks) {
  // Behind the sphere, before it, and all around it.
  const std::vector<Particle> clouds{ball({0, 0, -2.6f}, 1.8f, 1.5f), ball({0.3f, 0.2f, 2.9f}, 1.6f, 0.5f),
                                     ball({0, 0, 0}, 2.8f, 0.5f)};
  const std::vector<float> behind = sceneColours();
  for (std::size_t number = 0; number < clouds.size(); ++number) {
    draw_.particles = std::span(clouds).subspan(number, 1);
    for (const float wall : {kSky, 22.0f}) {
      const headless::Picture whole = renderAt(kSize, wall), half = renderAt(kSize / 2, wall);
      const std::vector<float> expected = over(whole.rgba, behind);
      const std::vector<float> full = sceneDepths(draw_.view, kSize, wall);
      const std::vector<float> made = composite(half, sceneDepths(draw_.view, kSize / 2, wall), behind, full);
      const double error = largest(made, expected), plain = largest(over(bilinear(half), behind), expected);
      // What is left is the picture's own coarseness: at a silhouette it is continued from one side alone.
      EXPECT_LT(error, number == 1 ? 0.06 : std::min(0.12, 0.4 * plain)) << number << ' ' << wall;
      // At equal resolution nothing is changed.
      EXPECT_LT(largest(composite(whole, full, behind, full), expected), 1e-5);
      if (number == 1) continue;
      EXPECT_GT(plain, 0.2) << "a test that plain filtering passes would be none";
    }
  }
}

TEST_F(Composite, PicturesWithoutASceneAreHiddenByIt) {
  const std::vector<Particle> clouds{ball({0, 0, -3.4f}, 1.9f, 1.5f), ball({0.3f, 0.2f, 3.2f}, 1.6f, 0.5f)};
  const std::vector<float> behind = sceneColours();
  for (std::size_t number = 0; number < clouds.size(); ++number) {
    draw_.particles = std::span(clouds).subspan(number, 1);
    const headless::Picture whole = renderAt(kSize, kSky);
    draw_.width = draw_.height = kSize / 2;
    const headless::Picture half = render(*metavoxels_, draw_);
    const std::vector<float> depths = sceneDepths(draw_.view, kSize, kSky);
    const std::vector<float> made = composite(half, {}, behind, depths);
    EXPECT_LT(largest(made, over(whole.rgba, behind)), 0.05) << number;
  }
}

TEST_F(Composite, WhatIsMissingIsNamed) {
  const auto refused = [&](const runtime::CompositeDraw& draw) {
    const auto done = gpu().run([&](VkCommandBuffer commands) { return compositor_->record(commands, draw); });
    return done ? std::string() : done.error().message;
  };
  EXPECT_NE(refused({}).find("width"), std::string::npos);
  EXPECT_NE(refused({.width = 4, .height = 4}).find("targetWidth"), std::string::npos);
  EXPECT_NE(refused({.width = 4, .height = 4, .targetWidth = 4, .targetHeight = 4}).find("color"), std::string::npos);
  EXPECT_FALSE(runtime::Compositor::create(*renderer_, 0));
}

}  // namespace
}  // namespace billow::tests
