// Bricks whose cells of 4x4x2 voxels have ends of their own, and indices between them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "encode/brick_lanes.h"
#include "encode/local_lanes.h"

namespace billow::compiler {
namespace {

// How far below the least value, in parts of the brick's range, base must reach: where index 0 is kept for inactive
// voxels, a cell's least value has index 1, and base lies a step below it.
double reachBelow(const Cells& cells, double last) {
  double most = 0;
  for (std::uint32_t c = 0; c < format::kLocalCells; ++c) {
    const auto low = static_cast<double>(cells.low[c >> 3][c & 7]);
    const auto high = static_cast<double>(cells.high[c >> 3][c & 7]);
    if (low <= high) most = std::max(most, (high - low) / (last - 1) - low);
  }
  return most;
}

// lo and scale with which the ends 0 to 255 reach from `below` under the range's least value to its greatest; false
// where that is not possible in single precision.
bool rangeOfEnds(ValueRange range, double below, std::uint32_t last, TexelRange& ends) {
  const auto low = static_cast<double>(range.min);
  const double width = static_cast<double>(range.max) - low;
  const double lo = low - below * width;
  if (lo < static_cast<double>(std::numeric_limits<float>::lowest())) return false;
  const std::uint32_t largest = 255 * last;
  // A tenth of a step of the ends is not seen.
  ends = shorten(lo, (width + below * width) / largest, largest, width / 2550);
  return ends.scale >= std::numeric_limits<float>::min() &&
         std::isfinite(format::reconstruct(ends.lo, ends.scale, largest));
}

void writeBrick(const CellFit& fit, std::uint32_t bits, std::byte* payload) {
  format::Texels indices;
  for (std::uint32_t i = 0; i < format::kBrickVoxels; ++i) {
    const std::uint32_t x = i >> 6, y = i >> 3 & 7, z = i & 7;
    const float index = fit.index[x >> 2][(x & 3) * 8 + (y & 3) * 2 + (z & 1)][(y >> 2) * 4 + (z >> 1)];
    indices[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(index));
  }
  for (std::uint32_t c = 0; c < format::kLocalCells; ++c) {
    payload[2 * c] = static_cast<std::byte>(static_cast<std::int32_t>(fit.base[c >> 3][c & 7]));
    payload[2 * c + 1] = static_cast<std::byte>(static_cast<std::int32_t>(fit.top[c >> 3][c & 7]));
  }
  format::packIndices(indices, bits, payload + format::kLocalCellBytes);
}

}  // namespace

void encodeLocal(const BrickSource& brick, std::uint32_t bits, Candidate& out) {
  const std::uint32_t last = (1u << bits) - 1;
  const ValueRange range = activeRange(brick);
  Cells cells;
  fillCells(brick, range, cells);
  std::uint32_t first = brick.activeCount < format::kBrickVoxels ? 1 : 0;
  TexelRange ends;
  if (!rangeOfEnds(range, first != 0 ? reachBelow(cells, last) : 0, last, ends)) {
    ends = coverRange(range, 0, 255 * last);
    if (ends.scale > 0) first = 0;
  }
  const double step = static_cast<double>(ends.scale) * last;
  const auto low = static_cast<double>(range.min);
  const double inverse = step > 0 ? 1 / step : 0;
  const CellScale scale = {static_cast<float>((low - static_cast<double>(ends.lo)) * inverse),
                           static_cast<float>((static_cast<double>(range.max) - low) * inverse),
                           static_cast<float>(first), static_cast<float>(last)};
  CellFit fit;
  fitCells(cells, scale, fit);
  out.encoding = format::localEncoding(bits);
  out.texelMask = first != 0;
  out.lo = ends.lo;
  out.scale = ends.scale;
  writeBrick(fit, bits, out.payload.data());
  format::Texels texels;
  format::decodeTexels(out.encoding, {out.payload.data(), *format::brickBytes(out.encoding)}, texels);
  measure(brick, texels, out);
}

std::array<double, 5> estimateLocals(const BrickSource& brick) {
  const ValueRange range = activeRange(brick);
  Cells cells;
  fillCells(brick, range, cells);
  double squares = 0;
  for (std::uint32_t c = 0; c < format::kLocalCells; ++c) {
    const auto low = static_cast<double>(cells.low[c >> 3][c & 7]);
    const auto high = static_cast<double>(cells.high[c >> 3][c & 7]);
    if (low < high) squares += static_cast<double>(cells.count[c >> 3][c & 7]) * (high - low) * (high - low);
  }
  const double width = static_cast<double>(range.max) - static_cast<double>(range.min);
  const double reserved = brick.activeCount < format::kBrickVoxels ? 1 : 0;
  std::array<double, 5> errors;
  for (std::uint32_t bits = 2; bits <= 6; ++bits) {
    const double levels = (1u << bits) - reserved;
    errors[bits - 2] = squares * width * width / (12 * levels * levels);
  }
  return errors;
}

}  // namespace billow::compiler
