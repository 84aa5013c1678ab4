// How far a grid frame may be from its source, as one number.
#ifndef BILLOW_FORMAT_PSNR_H
#define BILLOW_FORMAT_PSNR_H

#include <cmath>
#include <cstdint>
#include <limits>

#include "billow/format/layout.h"

namespace billow::format {

// Peak signal-to-noise ratio in decibels, 20 log10(range / sqrt(squaredError / count)) (spec/format.md, grid frames):
// infinity where nothing differs, minus infinity where something does and the range is 0.
// range: largest minus least value of the source, background included, >= 0. squaredError: sum over `count` voxels.
inline double psnr(double range, double squaredError, std::uint64_t count) {
  if (!(squaredError > 0) || count == 0) return std::numeric_limits<double>::infinity();
  return 20 * std::log10(range / std::sqrt(squaredError / static_cast<double>(count)));
}

// By what the compiler recorded.
inline double psnr(const GridFrame& frame) {
  const double range = static_cast<double>(frame.sourceMax) - static_cast<double>(frame.sourceMin);
  return psnr(range, frame.squaredError, frame.activeVoxels);
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_PSNR_H
