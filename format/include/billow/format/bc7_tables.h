// Constants of the BC7 format (Khronos Data Format Specification, "BPTC compressed texture image formats"), shared by
// the decoder here and the encoder in the compiler.
#ifndef BILLOW_FORMAT_BC7_TABLES_H
#define BILLOW_FORMAT_BC7_TABLES_H

#include <cstdint>

namespace billow::format {

// The fields of a block in the order in which they are stored, after a mode number in unary.
struct Bc7Mode {
  std::uint8_t subsets;
  std::uint8_t partitionBits;
  std::uint8_t rotationBits;
  std::uint8_t selectorBits;   // which index stream belongs to colour
  std::uint8_t colorBits;      // per endpoint channel, without p-bit
  std::uint8_t alphaBits;      // 0: alpha is 255
  std::uint8_t endpointPBits;  // p-bits per endpoint
  std::uint8_t subsetPBits;    // p-bits per subset, shared by its two endpoints
  std::uint8_t indexBits;
  std::uint8_t indexBits2;  // of a second index stream; 0: none
};

inline constexpr Bc7Mode kBc7Modes[8] = {
    {3, 4, 0, 0, 4, 0, 1, 0, 3, 0}, {2, 6, 0, 0, 6, 0, 0, 1, 3, 0}, {3, 6, 0, 0, 5, 0, 0, 0, 2, 0},
    {2, 6, 0, 0, 7, 0, 1, 0, 2, 0}, {1, 0, 2, 1, 5, 6, 0, 0, 2, 3}, {1, 0, 2, 0, 7, 8, 0, 0, 2, 2},
    {1, 0, 0, 0, 7, 7, 1, 0, 4, 0}, {2, 6, 0, 0, 5, 5, 1, 0, 2, 0},
};

// Weight of the second endpoint in 64ths, by index, for 2, 3 and 4 index bits.
inline constexpr std::uint8_t kBc7Weights2[4] = {0, 21, 43, 64};
inline constexpr std::uint8_t kBc7Weights3[8] = {0, 9, 18, 27, 37, 46, 55, 64};
inline constexpr std::uint8_t kBc7Weights4[16] = {0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};

constexpr const std::uint8_t* bc7Weights(std::uint32_t indexBits) {
  return indexBits == 2 ? kBc7Weights2 : indexBits == 3 ? kBc7Weights3 : kBc7Weights4;
}

// Two subsets: bit i is the subset of texel i.
inline constexpr std::uint16_t kBc7Partitions2[64] = {
    0xcccc, 0x8888, 0xeeee, 0xecc8, 0xc880, 0xfeec, 0xfec8, 0xec80, 0xc800, 0xffec, 0xfe80, 0xe800, 0xffe8,
    0xff00, 0xfff0, 0xf000, 0xf710, 0x008e, 0x7100, 0x08ce, 0x008c, 0x7310, 0x3100, 0x8cce, 0x088c, 0x3110,
    0x6666, 0x366c, 0x17e8, 0x0ff0, 0x718e, 0x399c, 0xaaaa, 0xf0f0, 0x5a5a, 0x33cc, 0x3c3c, 0x55aa, 0x9696,
    0xa55a, 0x73ce, 0x13c8, 0x324c, 0x3bdc, 0x6996, 0xc33c, 0x9966, 0x0660, 0x0272, 0x04e4, 0x4e40, 0x2720,
    0xc936, 0x936c, 0x39c6, 0x639c, 0x9336, 0x9cc6, 0x817e, 0xe718, 0xccf0, 0x0fcc, 0x7744, 0xee22,
};

// Three subsets: bits 2i and 2i + 1 are the subset of texel i.
inline constexpr std::uint32_t kBc7Partitions3[64] = {
    0xaa685050, 0x6a5a5040, 0x5a5a4200, 0x5450a0a8, 0xa5a50000, 0xa0a05050, 0x5555a0a0, 0x5a5a5050,
    0xaa550000, 0xaa555500, 0xaaaa5500, 0x90909090, 0x94949494, 0xa4a4a4a4, 0xa9a59450, 0x2a0a4250,
    0xa5945040, 0x0a425054, 0xa5a5a500, 0x55a0a0a0, 0xa8a85454, 0x6a6a4040, 0xa4a45000, 0x1a1a0500,
    0x0050a4a4, 0xaaa59090, 0x14696914, 0x69691400, 0xa08585a0, 0xaa821414, 0x50a4a450, 0x6a5a0200,
    0xa9a58000, 0x5090a0a8, 0xa8a09050, 0x24242424, 0x00aa5500, 0x24924924, 0x24499224, 0x50a50a50,
    0x500aa550, 0xaaaa4444, 0x66660000, 0xa5a0a5a0, 0x50a050a0, 0x69286928, 0x44aaaa44, 0x66666600,
    0xaa444444, 0x54a854a8, 0x95809580, 0x96969600, 0xa85454a8, 0x80959580, 0xaa141414, 0x96960000,
    0xaaaa1414, 0xa05050a0, 0xa0a5a5a0, 0x96000000, 0x40804080, 0xa9a8a9a8, 0xaaaaaa44, 0x2a4a5254,
};

// The anchor texel of a subset is stored with one index bit less, the high one being 0. Subset 0's is texel 0; the
// others' are one hexadecimal digit per partition.
inline constexpr char kBc7Anchors2[] = "fffffffffffffffff282288f28228822ff6828ff28222ff66268ff22fffff22f";
inline constexpr char kBc7Anchors3Second[] = "33ff83ff88666533338f336a588685ff8f356a8ff3f5ffff3f55585a5a8dfc33";
inline constexpr char kBc7Anchors3Third[] = "f883ff38fffffff8f8f3f8f83f6affa8f3faa89a6f8f3668f3ffffffffff3ff8";

constexpr std::uint32_t bc7Anchor(const char* table, std::uint32_t partition) {
  const char digit = table[partition];
  return static_cast<std::uint32_t>(digit <= '9' ? digit - '0' : digit - 'a' + 10);
}

// What a texel is for an endpoint pair and a weight in 64ths.
constexpr std::uint32_t bc7Interpolate(std::uint32_t e0, std::uint32_t e1, std::uint32_t weight) {
  return ((64 - weight) * e0 + weight * e1 + 32) >> 6;
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_BC7_TABLES_H
