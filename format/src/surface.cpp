#include "billow/format/surface.h"

#include <algorithm>
#include <cmath>

namespace billow::format {

// As Vulkan reads SNORM: the least number is as much as its neighbour.
std::array<double, 3> placeOf(const SurfacePoint& point, const float (&extent)[3]) {
  std::array<double, 3> place{};
  for (std::size_t i = 0; i < 3; ++i) {
    place[i] = static_cast<double>(extent[i]) * std::max(point.place[i] / 32767.0, -1.0);
  }
  return place;
}

// Cigolle et al. 2014, "A Survey of Efficient Representations for Independent Unit Vectors".
std::array<double, 3> normalOf(const SurfacePoint& point) {
  double x = std::max(point.normal[0] / 127.0, -1.0), y = std::max(point.normal[1] / 127.0, -1.0);
  const double z = 1 - std::abs(x) - std::abs(y);
  const double fold = std::max(-z, 0.0);
  x += x < 0 ? fold : -fold;
  y += y < 0 ? fold : -fold;
  const double length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

}  // namespace billow::format
