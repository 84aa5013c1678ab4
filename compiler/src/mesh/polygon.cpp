#include "mesh/polygon.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace billow::compiler {
namespace {

using Point = std::array<double, 2>;

// Twice the area of the triangle, above 0 where it is counterclockwise.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Seen along the axis to which the face is most nearly square, from its outside.
std::vector<Point> flatten(std::span<const Vertex> corners) {
  std::array<double, 3> normal{};  // Newell's
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vertex &a = corners[i], &b = corners[(i + 1) % corners.size()];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
      normal[k] += (static_cast<double>(a[u]) - static_cast<double>(b[u])) *
                   (static_cast<double>(a[v]) + static_cast<double>(b[v]));
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  }
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::vector<Point> flat(corners.size());
  std::transform(corners.begin(), corners.end(), flat.begin(), [&](const Vertex& corner) {
    const Point p{static_cast<double>(corner[u]), static_cast<double>(corner[v])};
    return normal[axis] < 0 ? Point{p[1], p[0]} : p;
  });
  return flat;
}

class Cutter {
 public:
  explicit Cutter(std::vector<Point> points) : points_(std::move(points)), left_(points_.size()) {
    std::iota(left_.begin(), left_.end(), std::size_t{0});
  }

  std::vector<std::array<std::size_t, 3>> cut() {
    std::vector<std::array<std::size_t, 3>> triangles;
    while (left_.size() > 3) {
      std::size_t ear = 0;
      while (ear < left_.size() && !isEar(ear)) ++ear;
      if (ear == left_.size()) ear = 0;
      triangles.push_back(around(ear));
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    triangles.push_back({left_[0], left_[1], left_[2]});
    return triangles;
  }

 private:
  std::array<std::size_t, 3> around(std::size_t i) const {
    const std::size_t n = left_.size();
    return {left_[(i + n - 1) % n], left_[i], left_[(i + 1) % n]};
  }

  bool isEar(std::size_t i) const {
    const auto corners = around(i);
    const Point &a = points_[corners[0]], &b = points_[corners[1]], &c = points_[corners[2]];
    if (!(turn(a, b, c) > 0)) return false;
    return std::none_of(left_.begin(), left_.end(), [&](std::size_t other) {
      const Point& p = points_[other];  // one at a corner's place does not lie within
      return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    });
  }

  std::vector<Point> points_;
  std::vector<std::size_t> left_;
};

}  // namespace

std::vector<std::array<std::size_t, 3>> cutPolygon(std::span<const Vertex> corners) {
  if (corners.size() == 3) return {{0, 1, 2}};
  return Cutter(flatten(corners)).cut();
}

}  // namespace billow::compiler
