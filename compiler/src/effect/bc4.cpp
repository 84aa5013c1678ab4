#include "effect/bc4.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace billow::compiler {
namespace {

constexpr int kSteps = 7;
constexpr int kReach = 4;  // how far inside of the texels' range ends are tried

struct Block {
  int high = 0, low = 0;                        // high > low, else all texels are high
  std::array<std::uint8_t, 16> steps{};         // 0: high, 7: low
  int error = std::numeric_limits<int>::max();  // of sevenths, squared
};

Block fit(const std::array<std::uint8_t, 16>& texels, int high, int low) {
  Block block{high, low, {}, 0};
  const int span = std::max(high - low, 1);
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const int below = high - texels[i];
    const int step = std::clamp((below * kSteps * 2 + span) / (2 * span), 0, high > low ? kSteps : 0);
    const int off = kSteps * below - step * (high - low);
    block.steps[i] = static_cast<std::uint8_t>(step);
    block.error += off * off;
  }
  return block;
}

}  // namespace

std::array<std::byte, 8> encodeBc4(const std::array<std::uint8_t, 16>& texels) {
  const auto [least, most] = std::minmax_element(texels.begin(), texels.end());
  Block best = fit(texels, *most, *least);
  for (int down = 0; down < kReach; ++down) {
    for (int up = 0; up < kReach; ++up) {
      if (*most - down <= *least + up) continue;
      const Block block = fit(texels, *most - down, *least + up);
      if (block.error < best.error) best = block;
    }
  }
  std::uint64_t indices = 0;
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const std::uint64_t step = best.steps[i];
    indices |= (step == 0 ? 0 : step == kSteps ? 1 : step + 1) << (3 * i);
  }
  std::array<std::byte, 8> bytes{static_cast<std::byte>(best.high), static_cast<std::byte>(best.low)};
  for (std::size_t i = 0; i < 6; ++i) bytes[2 + i] = static_cast<std::byte>(indices >> (8 * i) & 255);
  return bytes;
}

}  // namespace billow::compiler
