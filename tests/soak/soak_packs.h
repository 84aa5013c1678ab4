// The packs that the soak plays: small, but with every kind of brick, frames that are equal, and frames with nothing.
#ifndef BILLOW_TESTS_SOAK_PACKS_H
#define BILLOW_TESTS_SOAK_PACKS_H

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "../sample_pack.h"

namespace billow::tests {

struct SoakPack {
  std::vector<std::byte> bytes;
  std::uint32_t frames = 1;
  double last = 0, length = 1;  // seconds: where the last frame begins, and where it ends
};

inline constexpr double kSoakRate = 24;

inline SoakPack makeSoakPack(std::uint32_t seed, std::uint32_t frames, std::uint32_t bricks,
                             format::Compression compression) {
  using namespace format;
  SoakPack made{.bytes = {}, .frames = frames};
  made.last = (frames - 1) / kSoakRate;
  made.length = frames / kSoakRate;
  made.bytes = writePack({.pageBytes = 8u << 10, .compression = compression, .threads = 1}, [&](PackWriter& writer) {
    PackTables tables = sampleTables("cloud", {"density", "flames"}, frames);
    std::mt19937 random(seed);
    const auto builtGrid = [&](std::uint32_t count) {
      GridFrameBuilder builder(writer, 0);
      std::set<std::array<std::uint32_t, 3>> cells;
      while (cells.size() < count) {
        cells.insert({2 + static_cast<std::uint32_t>(random() % 8), 2 + static_cast<std::uint32_t>(random() % 8),
                      2 + static_cast<std::uint32_t>(random() % 8)});
      }
      for (const auto& cell : cells) {
        const auto brickSeed = static_cast<std::uint32_t>(random());
        const float scale = 0.2f + static_cast<float>(random() % 64) / 64;
        switch (random() % 6) {
          case 0:
            builder.brick(cell, kEncodingBc7Y, randomBytes(128, brickSeed), 0, scale / 256, kMaskAll);
            break;
          case 1:
            builder.brick(cell, uniformEncoding(3), randomBytes(192, brickSeed), 0, scale / 8, kMaskTexel);
            break;
          case 2:
            builder.brick(cell, kEncodingConstant, {}, scale, 0, kMaskAll);
            break;
          case 3:
            builder.brick(cell, kEncodingCoarse, randomBytes(64, brickSeed), 0, scale / 256, kMaskAll);
            break;
          default: {
            Mask3 mask{};
            for (auto& word : mask.words) word = static_cast<std::uint32_t>(random());
            builder.brick(cell, uniformEncoding(8), randomBytes(512, brickSeed), 0, scale / 256, 0, mask);
          }
        }
      }
      return builder.finish(tables);
    };
    for (std::uint32_t i = 0; i < frames; ++i) {
      const bool again = i > 1 && random() % 8 == 0;  // the frame before once more
      if (again) {
        const std::size_t before = tables.gridFrames.size() - 2;
        for (std::size_t grid = 0; grid < 2; ++grid) tables.gridFrames.push_back(tables.gridFrames[before + grid]);
        continue;
      }
      const std::uint32_t some = random() % 10 == 0 ? 0 : bricks / 2 + static_cast<std::uint32_t>(random() % bricks);
      tables.gridFrames.push_back(some == 0 ? absentGridFrame() : builtGrid(some));
      tables.gridFrames.push_back(random() % 3 == 0 ? absentGridFrame() : builtGrid(1 + bricks / 4));
    }
    return tables;
  });
  return made;
}

// The first two have the same frames at the same times, of other values.
inline std::vector<SoakPack> makeSoakPacks() {
  using enum format::Compression;
  return {makeSoakPack(1, 12, 24, fast), makeSoakPack(2, 12, 24, fast), makeSoakPack(3, 7, 40, small),
          makeSoakPack(9, 1, 60, fast), makeSoakPack(5, 40, 6, fast)};
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SOAK_PACKS_H
