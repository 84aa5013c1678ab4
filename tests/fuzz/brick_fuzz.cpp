// Any bytes are a brick of every encoding: decoding reads no byte too many and gives what the encoding can hold.
#include <cstdlib>
#include <vector>

#include "billow/format/brick.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace billow::format;
  const auto* first = reinterpret_cast<const std::byte*>(data);
  for (std::uint32_t encoding = 0; encoding < kEncodingCount; ++encoding) {
    const std::uint32_t needed = *brickBytes(encoding);
    if (size < needed) continue;
    const std::vector<std::byte> brick(first, first + needed);
    Texels texels;
    decodeTexels(encoding, brick, texels);
    for (const std::uint16_t texel : texels) {
      if (texel > largestTexel(encoding)) std::abort();
    }
    Node3 node{};
    node.brick = encoding << kEncodingShift;
    node.mask = indexBits(encoding) != 0 ? kMaskTexel : kMaskAll;
    node.scale = 1;
    Values values;
    Mask3 active;
    decodeBrick(node, nullptr, brick, -1, values, active);
    for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
      if (decodeTexel(encoding, brick, i >> 6, i >> 3 & 7, i & 7) != texels[i]) std::abort();
      const bool inactive = node.mask == kMaskTexel && decodeIndex(encoding, brick, i) == 0;
      if (maskBit(active, i) == inactive) std::abort();
      const float expected = maskBit(active, i) ? static_cast<float>(texels[i]) : -1;
      if (values[i] != expected) std::abort();
    }
  }
  return 0;
}
