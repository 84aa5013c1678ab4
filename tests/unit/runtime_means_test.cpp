// Means are drawn like any other frame: the picture is that of the full one, but for detail.
#include <gtest/gtest.h>

#include <cmath>

#include "gpu_fixture.h"

namespace billow::tests {
namespace {

// A ball of smoke over 16^3 bricks, thin at its edge.
std::vector<std::byte> ball() {
  return oneGridPack(0, [](GridFrameBuilder& grid) {
    for (std::uint32_t i = 0; i < 16 * 16 * 16; ++i) {
      const std::array<std::uint32_t, 3> cell{20 + i / 256, 20 + i / 16 % 16, 20 + i % 16};
      std::vector<std::byte> bytes(512);
      bool any = false;
      for (std::uint32_t v = 0; v < 512; ++v) {
        const std::uint32_t at[3] = {cell[0] * 8 + v / 64, cell[1] * 8 + v / 8 % 8, cell[2] * 8 + v % 8};
        double square = 0;
        for (const std::uint32_t x : at) square += (x - 223.5) * (x - 223.5);
        const double value = 250 * std::min(1.0, std::max(0.0, (60 - std::sqrt(square)) / 20));
        bytes[v] = static_cast<std::byte>(value);
        any = any || value >= 1;
      }
      if (any) grid.brick(cell, format::kEncodingUniform8, bytes, 0, 0.0005f, format::kMaskTexel);
    }
  });
}

class Means : public GpuTest {};

TEST_F(Means, DrawThePictureWithoutItsDetail) {
  const format::Pack pack = openPack(ball());
  const auto renderer = makeRenderer();
  headless::Picture pictures[2];
  std::uint64_t bytes[2];
  for (int i = 0; i < 2; ++i) {
    const auto frame = upload(*renderer, pack, 0, {.means = i == 1});
    bytes[i] = frame->stats().payload();
    runtime::DrawInfo draw{.frame = frame.get(), .width = 64, .height = 64};
    draw.view = runtime::lookAt({22, 22, 80}, {22.35, 22.35, 22.35}, {0, 1, 0}, 20);
    draw.quality.step = i == 1 ? 0.125f : 1;
    draw.quality.shadowStep = i == 1 ? 0.25f : 2;
    pictures[i] = valueOf(gpu().render(*renderer, draw), "render");
  }
  EXPECT_LT(bytes[1] * 50, bytes[0]);
  double sums[2] = {}, difference = 0;
  for (std::size_t p = 3; p < pictures[0].rgba.size(); p += 4) {
    for (int i = 0; i < 2; ++i) sums[i] += double{pictures[i].rgba[p]};
    difference += std::abs(double{pictures[0].rgba[p]} - double{pictures[1].rgba[p]});
  }
  EXPECT_GT(sums[0], 100);
  EXPECT_NEAR(sums[1] / sums[0], 1, 0.05);
  EXPECT_LT(difference / sums[0], 0.1);
}

}  // namespace
}  // namespace billow::tests
