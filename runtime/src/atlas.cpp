#include "atlas.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace billow::runtime {
namespace {

constexpr std::uint32_t kSlotDepth = 2;  // texels along z
constexpr std::uint32_t kBlockRows = 2;  // of a slot, in each slice
constexpr std::uint32_t kRowBytes = 32;  // two blocks

}  // namespace

VkFormat AtlasShape::format() const {
  return layers != 0 ? VK_FORMAT_BC7_UNORM_BLOCK : VK_FORMAT_R8_UNORM;
}

VkExtent3D AtlasShape::extent() const {
  if (layers == 0) return {1, 1, 1};
  return {8u << xBits, 8u << yBits, layers * kSlotDepth};
}

std::uint64_t AtlasShape::bytes() const {
  return layers != 0 ? slots() * kAtlasSlotBytes : 1;
}

std::optional<AtlasShape> atlasShape(std::uint32_t slots, std::uint32_t maxExtent) {
  const std::uint32_t maxLayers = maxExtent / kSlotDepth;
  const std::uint32_t maxBits = static_cast<std::uint32_t>(std::bit_width(maxExtent / 8) - 1);
  // A layer is at most 1/16 of the atlas, which bounds the slots that stay unused in the last one.
  const std::uint32_t wanted = static_cast<std::uint32_t>(std::max(0, int(std::bit_width(slots)) - 5));
  for (std::uint32_t bits = wanted; bits <= 2 * maxBits; ++bits) {
    AtlasShape shape{.xBits = (bits + 1) / 2, .yBits = bits / 2, .layers = 0};
    shape.layers = static_cast<std::uint32_t>((std::uint64_t{slots} + (1u << bits) - 1) >> bits);
    if (shape.layers <= maxLayers) return shape;
  }
  return std::nullopt;
}

void writeSlot(const AtlasShape& shape, std::uint32_t slot, std::span<const std::byte, kAtlasSlotBytes> brick,
               std::span<std::byte> image) {
  const std::size_t x = slot & ((1u << shape.xBits) - 1);
  const std::size_t y = slot >> shape.xBits & ((1u << shape.yBits) - 1);
  const std::size_t z = slot >> (shape.xBits + shape.yBits);
  const std::size_t imageRow = std::size_t{kRowBytes} << shape.xBits;
  const std::size_t imageRows = std::size_t{kBlockRows} << shape.yBits;
  const std::byte* source = brick.data();
  for (std::size_t slice = 0; slice < kSlotDepth; ++slice) {
    for (std::size_t row = 0; row < kBlockRows; ++row) {
      const std::size_t to = ((z * kSlotDepth + slice) * imageRows + y * kBlockRows + row) * imageRow + x * kRowBytes;
      std::memcpy(image.subspan(to, kRowBytes).data(), source, kRowBytes);
      source += kRowBytes;
    }
  }
}

}  // namespace billow::runtime
