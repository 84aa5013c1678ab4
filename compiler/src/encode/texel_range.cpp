#include "encode/texel_range.h"

#include <algorithm>
#include <bit>
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

float shorten(double value, double tolerance) {
  const auto exact = static_cast<float>(value);
  for (const std::uint32_t bits : {16u, 11u, 8u, 4u}) {
    const std::uint32_t unit = 1u << bits;
    const std::uint32_t word = std::bit_cast<std::uint32_t>(exact);
    // To nearest; a carry out of the mantissa raises the exponent, as it should.
    const auto rounded = std::bit_cast<float>((word + unit / 2) & ~(unit - 1));
    if (std::isfinite(rounded) && std::abs(static_cast<double>(rounded) - value) <= tolerance) return rounded;
  }
  return exact;
}

TexelRange shorten(double lo, double scale, std::uint32_t last, double tolerance) {
  return {shorten(lo, tolerance / 2), shorten(scale, tolerance / 2 / last)};
}

}  // namespace billow::compiler
