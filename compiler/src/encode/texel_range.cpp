#include "encode/texel_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace billow::compiler {

TexelRange coverRange(ValueRange range, std::uint32_t first, std::uint32_t last) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  const double steps = last - first;
  const double width = static_cast<double>(range.max) - static_cast<double>(range.min);
  if (!(width > 0)) return {range.min, 0};
  const double step = std::min(width / steps, kLargest / last);
  float scale = static_cast<float>(step);
  // Near the denormals one unit of `scale` is a large part of it: take the next above, or the top would be cut.
  if (static_cast<double>(scale) * steps < width) scale = std::nextafter(scale, std::numeric_limits<float>::max());
  const double wanted = static_cast<double>(range.min) - static_cast<double>(scale) * first;
  const float lo = wanted < -kLargest ? -std::numeric_limits<float>::infinity() : static_cast<float>(wanted);
  while (std::isfinite(lo) && !std::isfinite(format::reconstruct(lo, scale, last))) scale = std::nextafter(scale, 0.0f);
  return {lo, scale};
}

}  // namespace billow::compiler
