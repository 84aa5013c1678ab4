#include "billow/format/similarity.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "quaternion.h"

namespace billow::format {
namespace {

using Vec3 = std::array<double, 3>;

constexpr double kTolerance = 1e-4;
constexpr double kMinScale = 1e-6, kMaxScale = 1e6;

double dot(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The quaternion's component that is largest is found first, so that nothing is divided by little.
Quaternion quaternionOf(const std::array<Vec3, 3>& columns) {
  const auto m = [&](std::size_t row, std::size_t column) { return columns[column][row]; };
  const double trace = m(0, 0) + m(1, 1) + m(2, 2);
  const double four[4] = {1 + 2 * m(0, 0) - trace, 1 + 2 * m(1, 1) - trace, 1 + 2 * m(2, 2) - trace, 1 + trace};
  const auto largest = static_cast<std::size_t>(std::max_element(four, four + 4) - four);
  Quaternion q{};
  q[largest] = four[largest];
  if (largest == 3) {
    for (std::size_t i = 0; i < 3; ++i) q[i] = m((i + 2) % 3, (i + 1) % 3) - m((i + 1) % 3, (i + 2) % 3);
  } else {
    const std::size_t j = (largest + 1) % 3, k = (largest + 2) % 3;
    q[j] = m(j, largest) + m(largest, j);
    q[k] = m(k, largest) + m(largest, k);
    q[3] = m(k, j) - m(j, k);
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& part : q) part /= length;
  return q;
}

}  // namespace

std::optional<Similarity> similarityOf(const std::array<double, 12>& matrix) {
  for (const double number : matrix) {
    if (!(std::abs(number) <= 1e18)) return std::nullopt;
  }
  std::array<Vec3, 3> columns{};
  for (std::size_t i = 0; i < 3; ++i) columns[i] = {matrix[i], matrix[4 + i], matrix[8 + i]};
  if (!(dot(columns[0], cross(columns[1], columns[2])) > 0)) return std::nullopt;
  double squares = 0;
  for (const Vec3& column : columns) squares += dot(column, column);
  const double scale = std::sqrt(squares / 3);
  if (!(scale >= kMinScale && scale <= kMaxScale)) return std::nullopt;
  for (Vec3& column : columns) {
    for (double& part : column) part /= scale;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(std::abs(dot(columns[i], columns[i]) - 1) <= 2 * kTolerance)) return std::nullopt;
    if (!(std::abs(dot(columns[i], columns[(i + 1) % 3])) <= kTolerance)) return std::nullopt;
  }
  return Similarity{quaternionOf(columns), {matrix[3], matrix[7], matrix[11]}, scale};
}

std::array<double, 3> transformedWay(const std::array<double, 3>& way, const Similarity& by) {
  const Vec3 axis{by.rotation[0], by.rotation[1], by.rotation[2]};
  const Vec3 t = cross(axis, way), u = cross(axis, t);
  Vec3 turned{};
  for (std::size_t i = 0; i < 3; ++i) turned[i] = by.scale * (way[i] + 2 * (by.rotation[3] * t[i] + u[i]));
  return turned;
}

std::array<double, 3> transformed(const std::array<double, 3>& point, const Similarity& by) {
  Vec3 moved = transformedWay(point, by);
  for (std::size_t i = 0; i < 3; ++i) moved[i] += by.translation[i];
  return moved;
}

Particle transformed(const Particle& particle, const Similarity& by) {
  Particle result = particle;
  const auto scale = static_cast<float>(by.scale), shrink = static_cast<float>(1 / by.scale);
  Vec3 center{};
  Quaternion rotation{};
  for (std::size_t i = 0; i < 3; ++i) center[i] = static_cast<double>(particle.center[i]);
  for (std::size_t i = 0; i < 4; ++i) rotation[i] = static_cast<double>(particle.rotation[i]);
  center = transformed(center, by);
  rotation = product(by.rotation, rotation);
  for (std::size_t i = 0; i < 4; ++i) result.rotation[i] = static_cast<float>(rotation[i]);
  for (std::size_t i = 0; i < 3; ++i) {
    result.center[i] = static_cast<float>(center[i]);
    result.shape[i] *= scale;
    result.emission[i] *= shrink;
  }
  result.radius *= scale;
  result.extinction *= shrink;
  return result;
}

}  // namespace billow::format
