// BC4 blocks: 4x4 texels of one channel in 8 bytes.
#ifndef BILLOW_COMPILER_EFFECT_BC4_H
#define BILLOW_COMPILER_EFFECT_BC4_H

#include <array>
#include <cstddef>
#include <cstdint>

namespace billow::compiler {

// The eight values are between two ends that lie at or near the texels' own; the ends with the least squared error of
// those tried.
std::array<std::byte, 8> encodeBc4(const std::array<std::uint8_t, 16>& texels);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_EFFECT_BC4_H
