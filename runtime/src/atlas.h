// The atlas: a 3D image of BC7 whose slots hold a brick each, 8x8x2 texels.
#ifndef BILLOW_RUNTIME_ATLAS_H
#define BILLOW_RUNTIME_ATLAS_H

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <vulkan/vulkan_core.h>

namespace billow::runtime {

inline constexpr std::uint32_t kAtlasSlotBytes = 128;

// Slots along x and y are powers of two, so that a shader finds a slot by shifts. Without slots the image is one texel
// of R8, for a descriptor must be valid though nothing is read through it.
struct AtlasShape {
  std::uint32_t xBits = 0;
  std::uint32_t yBits = 0;
  std::uint32_t layers = 0;  // slots along z

  VkFormat format() const;
  VkExtent3D extent() const;  // texels
  std::uint64_t slots() const { return std::uint64_t{layers} << (xBits + yBits); }
  std::uint64_t bytes() const;
};

// The smallest shape near a cube for so many slots; nullopt where none fits into maxExtent texels an axis.
std::optional<AtlasShape> atlasShape(std::uint32_t slots, std::uint32_t maxExtent);

// Copies a BC7 brick into its slot of the image's bytes (tightly packed, as a buffer-to-image copy reads them).
void writeSlot(const AtlasShape& shape, std::uint32_t slot, std::span<const std::byte, kAtlasSlotBytes> brick,
               std::span<std::byte> image);

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_ATLAS_H
