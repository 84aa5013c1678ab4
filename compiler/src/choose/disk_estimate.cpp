#include "choose/disk_estimate.h"

#include <algorithm>
#include <array>
#include <bit>

namespace billow::compiler {
namespace {

// A stored mask, and a node with its place in a child list, in compressed pages of real smoke and fire.
constexpr std::uint32_t kMaskBytes = 14;
constexpr std::uint32_t kNodeBytes = 10;

// Fractional part of log2 of 1 + i / 256, in 1/256 bit: log2(y) of a y in [1, 2) bit by bit, by squaring.
constexpr std::array<std::uint8_t, 256> kLog2Fractions = [] {
  std::array<std::uint8_t, 256> table{};
  for (std::uint64_t i = 0; i < 256; ++i) {
    std::uint64_t y = (256 + i) << 22;  // 2^30 is 1
    std::uint32_t bits = 0;
    for (int b = 0; b < 8; ++b) {
      y = y * y >> 30;
      bits <<= 1;
      if (y >= std::uint64_t{2} << 30) {
        y >>= 1;
        bits |= 1;
      }
    }
    table[i] = static_cast<std::uint8_t>(bits);
  }
  return table;
}();

using Symbols = std::array<std::uint8_t, format::kBrickVoxels>;  // by voxelIndex

// Indices of up to 8 bits from behind `begin`.
void readIndices(const Candidate& candidate, std::uint32_t begin, std::uint32_t bits, Symbols& symbols) {
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    const std::uint32_t at = v * bits;
    const std::byte* bytes = candidate.payload.data() + begin + at / 8;
    std::uint32_t word = std::to_integer<std::uint32_t>(bytes[0]);
    if (at % 8 + bits > 8) word |= std::to_integer<std::uint32_t>(bytes[1]) << 8;
    symbols[v] = static_cast<std::uint8_t>(word >> at % 8 & ((1u << bits) - 1));
  }
}

// Entropy of what is left of active voxels' symbols after a prediction: the mean of the neighbours before them along
// the three axes, rounded. Inactive voxels are not coded.
std::uint32_t residualBytes(const Symbols& symbols, const format::Mask3& active) {
  std::array<std::uint32_t, 256> counts{};
  for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
    if (!format::maskBit(active, v)) continue;
    std::uint32_t sum = 0, neighbours = 0;
    for (const std::uint32_t shift : {0u, 3u, 6u}) {
      if ((v >> shift & 7) == 0 || !format::maskBit(active, v - (1u << shift))) continue;
      sum += symbols[v - (1u << shift)];
      ++neighbours;
    }
    const std::uint32_t predicted = neighbours == 0 ? 0 : (sum + neighbours / 2) / neighbours;
    ++counts[(symbols[v] - predicted) & 255];
  }
  return entropyBytes(counts);
}

std::uint32_t payloadBytes(const Candidate& candidate, const format::Mask3& active) {
  const std::uint32_t bytes = *format::brickBytes(candidate.encoding);
  const std::uint32_t bits = format::indexBits(candidate.encoding);
  Symbols symbols;
  if (bits == 16) {  // high bytes like 8 bits, low ones as they are
    std::uint32_t low = 0;
    for (std::uint32_t v = 0; v < format::kBrickVoxels; ++v) {
      symbols[v] = std::to_integer<std::uint8_t>(candidate.payload[2 * v + 1]);
      low += format::maskBit(active, v) ? 1 : 0;
    }
    return residualBytes(symbols, active) + low;
  }
  if (bits == 0) return bytes - bytes / 8;  // BC7 and coarse: as good as incompressible
  const std::uint32_t cells = format::isLocal(candidate.encoding) ? format::kLocalCellBytes : 0;
  readIndices(candidate, cells, bits, symbols);
  return cells - cells / 4 + residualBytes(symbols, active);
}

}  // namespace

std::uint32_t log2In256ths(std::uint32_t value) {
  const auto whole = static_cast<std::uint32_t>(std::bit_width(value)) - 1;
  const std::uint32_t mantissa = whole >= 8 ? value >> (whole - 8) : value << (8 - whole);
  return whole << 8 | kLog2Fractions[mantissa & 255];
}

std::uint32_t entropyBytes(std::span<const std::uint32_t> counts) {
  std::uint32_t total = 0;
  std::uint64_t sum = 0;
  for (const std::uint32_t count : counts) {
    if (count == 0) continue;
    total += count;
    sum += std::uint64_t{count} * log2In256ths(count);
  }
  if (total == 0) return 0;
  const std::uint64_t whole = std::uint64_t{total} * log2In256ths(total);
  const std::uint64_t bits = whole > sum ? whole - sum : 0;
  return static_cast<std::uint32_t>((bits + 2047) / 2048);
}

std::uint32_t estimateDiskBytes(const Candidate& candidate, const format::Mask3& active, bool storesMask) {
  return kNodeBytes + (storesMask ? kMaskBytes : 0) + payloadBytes(candidate, active);
}

}  // namespace billow::compiler
