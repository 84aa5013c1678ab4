#include "billow/format/brick.h"

namespace billow::format {

void decodeBc4Block(const std::byte* block, std::uint8_t texels[16]) {
  const auto a = std::to_integer<std::uint32_t>(block[0]);
  const auto b = std::to_integer<std::uint32_t>(block[1]);
  std::uint32_t palette[8] = {a, b, 0, 0, 0, 0, 0, 255};
  // Adding half of an odd divisor, rounded down, before dividing rounds to nearest: half-way cannot occur.
  if (a > b) {
    for (std::uint32_t i = 1; i < 7; ++i) palette[i + 1] = ((7 - i) * a + i * b + 3) / 7;
  } else {
    for (std::uint32_t i = 1; i < 5; ++i) palette[i + 1] = ((5 - i) * a + i * b + 2) / 5;
  }
  std::uint64_t indices = 0;
  for (std::uint32_t i = 0; i < 6; ++i) indices |= std::to_integer<std::uint64_t>(block[2 + i]) << (8 * i);
  for (std::uint32_t i = 0; i < 16; ++i) texels[i] = static_cast<std::uint8_t>(palette[indices >> (3 * i) & 7]);
}

}  // namespace billow::format
