// Whatever path a device takes for a brick, it must read the integers that the format promises: BC7 blocks of every
// mode, and every other encoding with random and with extreme bytes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "gpu_fixture.h"

namespace billow::tests {
namespace {

// One brick a cell from cell (0, 0, 0) on, 16 cells along z, then y, then x; values are the texels themselves.
std::vector<std::byte> packOf(const std::vector<std::vector<std::byte>>& bricks, std::uint32_t encoding) {
  return oneGridPack(0, [&](GridFrameBuilder& grid) {
    for (std::uint32_t i = 0; i < bricks.size(); ++i) {
      grid.brick({i >> 8, i >> 4 & 15, i & 15}, encoding, bricks[i], 0, 1, format::kMaskAll);
    }
  });
}

class Texels : public GpuTest {
 protected:
  // Texels that differ, by what `describe` says of brick and voxel.
  template <class Describe>
  void expectExact(const std::vector<std::vector<std::byte>>& bricks, std::uint32_t encoding,
                   const Describe& describe) {
    const format::Pack pack = openPack(packOf(bricks, encoding));
    const auto renderer = makeRenderer({.blocks = runtime::BlockUse::native});
    const auto frame = upload(*renderer, pack);
    std::vector<float> positions;
    for (std::uint32_t i = 0; i < bricks.size(); ++i) {
      for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
        positions.push_back(static_cast<float>((i >> 8) * 8 + (v >> 6)));
        positions.push_back(static_cast<float>((i >> 4 & 15) * 8 + (v >> 3 & 7)));
        positions.push_back(static_cast<float>((i & 15) * 8 + (v & 7)));
      }
    }
    const auto values = gpu().lookup(*renderer, *frame, 0, runtime::Filter::nearest, positions);
    ASSERT_TRUE(values.has_value()) << values.error().message;
    std::size_t wrong = 0;
    for (std::uint32_t i = 0; i < bricks.size(); ++i) {
      format::Texels texels;
      format::decodeTexels(encoding, bricks[i], texels);
      for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
        const float value = (*values)[i * format::kBrickVoxels + v];
        if (value == static_cast<float>(texels[v])) continue;
        if (++wrong <= 20) ADD_FAILURE() << describe(i, v) << ": GPU " << value << ", CPU " << texels[v];
      }
    }
    EXPECT_EQ(wrong, 0u) << "of " << values->size();
  }
};

TEST_F(Texels, Bc7OfEveryMode) {
  std::vector<std::vector<std::byte>> bricks;
  for (std::uint32_t i = 0; i < 256; ++i) {
    bricks.push_back(randomBytes(128, i));
    for (std::size_t block = 0; block < 8; ++block) {
      std::byte& first = bricks.back()[block * 16];
      first = (first | std::byte{1}) << static_cast<int>(i % 8);  // the lowest set bit is the mode
    }
  }
  expectExact(bricks, format::kEncodingBc7Z,
              [](std::uint32_t i, std::uint32_t v) { return fmt::format("mode {}, brick {}, voxel {}", i % 8, i, v); });
}

TEST_F(Texels, OfEveryEncodingInTheBuffer) {
  for (std::uint32_t encoding = format::kEncodingUniform1; encoding < format::kEncodingCount; ++encoding) {
    const std::uint32_t bytes = *format::brickBytes(encoding);
    std::vector<std::vector<std::byte>> bricks{std::vector(bytes, std::byte{0}), std::vector(bytes, std::byte{0xff})};
    for (std::uint32_t i = 0; i < 30; ++i) bricks.push_back(randomBytes(bytes, 100 * encoding + i));
    expectExact(bricks, encoding, [&](std::uint32_t i, std::uint32_t v) {
      return fmt::format("encoding {}, brick {}, voxel {}", encoding, i, v);
    });
  }
}

}  // namespace
}  // namespace billow::tests
