#include "effect/surface_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "billow/format/noise.h"

namespace billow::compiler {
namespace {

using Point = std::array<double, 3>;
using Corners = std::array<Point, 3>;

Corners scaled(const Triangle& triangle, const Point& scale) {
  Corners corners{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) corners[i][k] = static_cast<double>(triangle[i][k]) * scale[k];
  }
  return corners;
}

double lengthOf(const Point& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// Uniform over the triangle by two numbers in [0, 1) (Osada et al. 2002, "Shape Distributions").
Point pointIn(const Corners& corners, double a, double b) {
  const double root = std::sqrt(a);
  const double weights[] = {1 - root, root * (1 - b), root * b};
  Point result{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) result[k] += corners[i][k] * weights[i];
  }
  return result;
}

std::int8_t octahedralStep(double share) {
  return static_cast<std::int8_t>(std::floor(std::clamp(share, -1.0, 1.0) * 127 + 0.5));
}

void setNormal(const Point& along, format::SurfacePoint& point) {
  const double sum = std::abs(along[0]) + std::abs(along[1]) + std::abs(along[2]);
  double x = along[0] / sum, y = along[1] / sum;
  if (along[2] < 0) {
    const double folded = (1 - std::abs(y)) * (x < 0 ? -1 : 1);
    y = (1 - std::abs(x)) * (y < 0 ? -1 : 1);
    x = folded;
  }
  point.normal[0] = octahedralStep(x);
  point.normal[1] = octahedralStep(y);
}

void setPlace(const Point& place, const MeshBox& box, format::SurfacePoint& point) {
  for (std::size_t k = 0; k < 3; ++k) {
    const double half = static_cast<double>(box.halfSides[k]);
    const double share = half > 0 ? (place[k] - box.middle[k]) / half : 0;
    point.place[k] = static_cast<std::int16_t>(std::floor(std::clamp(share, -1.0, 1.0) * 32767 + 0.5));
  }
}

// Number i of a sequence that covers the unit square evenly, and any stretch of which does (Roberts 2018, "The
// Unreasonable Effectiveness of Quasirandom Sequences").
std::array<double, 2> evenly(std::uint32_t i) {
  return {i * 3242174889u / 4294967296.0, i * 2447445414u / 4294967296.0};
}

}  // namespace

MeshBox boxOf(const MeshShape& mesh) {
  Point least{}, most{};
  least.fill(std::numeric_limits<double>::max());
  most.fill(std::numeric_limits<double>::lowest());
  for (const Triangle& triangle : mesh.triangles) {
    for (const Point& corner : scaled(triangle, mesh.scale)) {
      for (std::size_t k = 0; k < 3; ++k) {
        least[k] = std::min(least[k], corner[k]);
        most[k] = std::max(most[k], corner[k]);
      }
    }
  }
  MeshBox box;
  for (std::size_t k = 0; k < 3; ++k) {
    box.middle[k] = (least[k] + most[k]) / 2;
    box.halfSides[k] = static_cast<float>((most[k] - least[k]) / 2);
  }
  return box;
}

std::uint32_t pointsFor(std::uint64_t particles) {
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(particles * 4, 1024, format::kMaxSurfacePoints));
}

Surface placePoints(const MeshShape& mesh, std::uint32_t count) {
  Surface surface{boxOf(mesh), std::vector<format::SurfacePoint>(count)};
  std::vector<double> areaUpTo(mesh.triangles.size());
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Corners c = scaled(mesh.triangles[t], mesh.scale);
    areaUpTo[t] = area += lengthOf(areaVector(c[0], c[1], c[2]));
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    // Anywhere in the point's share of the area, so that no order of the triangles favours one.
    const double share = (i + static_cast<double>(format::unitOf(format::hashInteger(i)))) / count;
    const auto found = std::upper_bound(areaUpTo.begin(), areaUpTo.end(), share * area);
    const auto last = std::lower_bound(areaUpTo.begin(), areaUpTo.end(), area);  // that adds to it
    const auto t = static_cast<std::size_t>(std::min(found, last) - areaUpTo.begin());
    const Corners corners = scaled(mesh.triangles[t], mesh.scale);
    const auto [a, b] = evenly(i);
    setPlace(pointIn(corners, a, b), surface, surface.points[i]);
    setNormal(areaVector(corners[0], corners[1], corners[2]), surface.points[i]);
  }
  return surface;
}

}  // namespace billow::compiler
