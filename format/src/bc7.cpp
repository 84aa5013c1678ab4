// A BC7 decoder for all eight modes, laid out in the order of the specification's block fields.
#include <bit>
#include <cstring>
#include <utility>

#include "billow/format/bc7_tables.h"
#include "billow/format/brick.h"

namespace billow::format {
namespace {

// 128 bits, least significant first.
class BitReader {
 public:
  explicit BitReader(const std::byte* block) : low_(load(block)), high_(load(block + 8)) {}

  // `count` in [0, 32].
  std::uint32_t take(std::uint32_t count) {
    if (count == 0) return 0;
    const std::uint64_t bits = low_ & ((std::uint64_t{1} << count) - 1);
    low_ = low_ >> count | high_ << (64 - count);
    high_ >>= count;
    return static_cast<std::uint32_t>(bits);
  }

 private:
  static std::uint64_t load(const std::byte* bytes) {
    std::uint64_t word = 0;
    for (std::uint32_t i = 0; i < 8; ++i) word |= std::to_integer<std::uint64_t>(bytes[i]) << (8 * i);
    return word;
  }

  std::uint64_t low_, high_;
};

struct Endpoints {
  std::uint32_t channel[6][4];  // two per subset, RGBA
};

// Repeats the high bits of a `bits`-wide value below it, to fill eight.
std::uint32_t widen(std::uint32_t value, std::uint32_t bits) {
  return (value << (8 - bits)) | (value >> (2 * bits - 8));
}

Endpoints readEndpoints(const Bc7Mode& mode, BitReader& reader) {
  Endpoints endpoints{};
  const std::uint32_t count = 2u * mode.subsets;
  for (std::uint32_t c = 0; c < 4; ++c) {
    const std::uint32_t bits = c < 3 ? mode.colorBits : mode.alphaBits;
    for (std::uint32_t e = 0; e < count; ++e) endpoints.channel[e][c] = reader.take(bits);
  }
  const std::uint32_t extra = mode.endpointPBits | mode.subsetPBits;
  std::uint32_t p[6] = {};
  if (mode.endpointPBits != 0) {
    for (std::uint32_t e = 0; e < count; ++e) p[e] = reader.take(1);
  } else if (mode.subsetPBits != 0) {
    for (std::uint32_t s = 0; s < mode.subsets; ++s) p[2 * s] = p[2 * s + 1] = reader.take(1);
  }
  for (std::uint32_t e = 0; e < count; ++e) {
    for (std::uint32_t c = 0; c < 4; ++c) {
      const std::uint32_t bits = c < 3 ? mode.colorBits : mode.alphaBits;
      std::uint32_t& value = endpoints.channel[e][c];
      value = bits == 0 ? 255u : widen(value << extra | p[e] * extra, bits + extra);
    }
  }
  return endpoints;
}

// The subset of every texel (two bits each) and the set of texels whose index lacks its high bit.
struct Partition {
  std::uint32_t subsets = 0;
  std::uint32_t anchors = 1;

  Partition(std::uint32_t subsetCount, std::uint32_t number) {
    if (subsetCount == 2) {
      for (std::uint32_t i = 0; i < 16; ++i) subsets |= (kBc7Partitions2[number] >> i & 1u) << (2 * i);
      anchors |= 1u << bc7Anchor(kBc7Anchors2, number);
    } else if (subsetCount == 3) {
      subsets = kBc7Partitions3[number];
      anchors |= 1u << bc7Anchor(kBc7Anchors3Second, number) | 1u << bc7Anchor(kBc7Anchors3Third, number);
    }
  }
};

void readWeights(BitReader& reader, std::uint32_t indexBits, std::uint32_t anchors, std::uint32_t weights[16]) {
  const std::uint8_t* table = bc7Weights(indexBits);
  for (std::uint32_t i = 0; i < 16; ++i) weights[i] = table[reader.take(indexBits - (anchors >> i & 1u))];
}

}  // namespace

void decodeBc7Block(const std::byte* block, std::uint8_t rgba[16][4]) {
  const auto modeNumber = static_cast<std::uint32_t>(std::countr_zero(std::to_integer<std::uint8_t>(block[0])));
  if (modeNumber >= 8) {
    std::memset(rgba, 0, 64);
    return;
  }
  const Bc7Mode& mode = kBc7Modes[modeNumber];
  BitReader reader(block);
  reader.take(modeNumber + 1);
  const Partition partition(mode.subsets, reader.take(mode.partitionBits));
  const std::uint32_t rotation = reader.take(mode.rotationBits);
  const bool colorIsSecond = reader.take(mode.selectorBits) != 0;
  const Endpoints endpoints = readEndpoints(mode, reader);
  std::uint32_t weights[2][16];
  readWeights(reader, mode.indexBits, partition.anchors, weights[0]);
  if (mode.indexBits2 != 0) {
    readWeights(reader, mode.indexBits2, partition.anchors, weights[1]);
  }
  const std::uint32_t* colorWeights = weights[colorIsSecond ? 1 : 0];
  const std::uint32_t* alphaWeights = weights[mode.indexBits2 != 0 && !colorIsSecond ? 1 : 0];
  for (std::uint32_t i = 0; i < 16; ++i) {
    const std::uint32_t subset = partition.subsets >> (2 * i) & 3u;
    const std::uint32_t* e0 = endpoints.channel[2 * subset];
    const std::uint32_t* e1 = endpoints.channel[2 * subset + 1];
    for (std::uint32_t c = 0; c < 4; ++c) {
      const std::uint32_t weight = c < 3 ? colorWeights[i] : alphaWeights[i];
      rgba[i][c] = static_cast<std::uint8_t>(bc7Interpolate(e0[c], e1[c], weight));
    }
    if (rotation != 0) std::swap(rgba[i][3], rgba[i][rotation - 1]);
  }
}

}  // namespace billow::format
