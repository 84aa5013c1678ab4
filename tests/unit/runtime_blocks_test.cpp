// Whatever path a device takes for BC4 and BC7 blocks, it must read the integers that the format promises: every pair
// of BC4 endpoints with every index, and BC7 blocks of every mode.
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

class Blocks : public GpuTest {
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

TEST_F(Blocks, Bc4OfEveryPairOfEndpoints) {
  // Eight bytes: endpoints, then sixteen indices of three bits, here 0 to 7 twice.
  constexpr std::uint64_t kIndices = 0xfac688fac688u;
  std::vector<std::vector<std::byte>> bricks;
  for (std::uint32_t pair = 0; pair < 65536; ++pair) {
    if (pair % 32 == 0) bricks.emplace_back();
    const std::uint64_t block = (kIndices << 16 | pair);
    for (int byte = 0; byte < 8; ++byte) bricks.back().push_back(static_cast<std::byte>(block >> (8 * byte) & 0xff));
  }
  expectExact(bricks, format::kEncodingBc4Z, [](std::uint32_t i, std::uint32_t v) {
    const std::uint32_t x = v >> 6, y = v >> 3 & 7, z = v & 7;
    const std::uint32_t pair = i * 32 + z * 4 + (y >> 2) * 2 + (x >> 2);
    return fmt::format("endpoints {} and {}, index {}", pair & 0xff, pair >> 8, ((y & 3) * 4 + (x & 3)) % 8);
  });
}

TEST_F(Blocks, Bc7OfEveryMode) {
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

}  // namespace
}  // namespace billow::tests
