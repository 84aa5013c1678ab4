#include "metric/depth_distortion.h"

#include <cstddef>
#include <span>

namespace billow::compiler {
namespace {

constexpr std::size_t kEdge = 8;
constexpr std::size_t kDiagonals = 2 * kEdge - 1;

double squares(std::span<const double> sums) {
  double result = 0;
  for (const double sum : sums) result += sum * sum;
  return result;
}

// The brick's voxels are read 8 times 8 rows of 8 along z; the sums along a direction are kept so that the 8 sums that
// a row adds to lie side by side.
struct Sums {
  double x[kEdge * kEdge] = {};                                           // (y, z)
  double y[kEdge * kEdge] = {};                                           // (x, z)
  double z[kEdge * kEdge] = {};                                           // (x, y)
  double xyDown[kDiagonals * kEdge] = {}, xyUp[kDiagonals * kEdge] = {};  // (x -+ y, z)
  double xzDown[kEdge * kDiagonals] = {}, xzUp[kEdge * kDiagonals] = {};  // (y, x -+ z)
  double yzDown[kEdge * kDiagonals] = {}, yzUp[kEdge * kDiagonals] = {};  // (x, y -+ z)

  void addRow(std::size_t row, std::size_t column, const float* error) {
    double along = 0;
    for (std::size_t i = 0; i < kEdge; ++i) {
      const auto e = static_cast<double>(error[i]);
      const std::size_t opposite = kEdge - 1 - i;
      x[column * kEdge + i] += e;
      y[row * kEdge + i] += e;
      xyDown[(row + kEdge - 1 - column) * kEdge + i] += e;
      xyUp[(row + column) * kEdge + i] += e;
      xzDown[column * kDiagonals + row + opposite] += e;
      xzUp[column * kDiagonals + row + i] += e;
      yzDown[row * kDiagonals + column + opposite] += e;
      yzUp[row * kDiagonals + column + i] += e;
      along += e;
    }
    z[row * kEdge + column] = along;
  }

  double distortion() const {
    const double diagonals =
        squares(xyDown) + squares(xyUp) + squares(xzDown) + squares(xzUp) + squares(yzDown) + squares(yzUp);
    return squares(x) + squares(y) + squares(z) + 2 * diagonals;  // a diagonal's step is sqrt(2) long
  }
};

}  // namespace

double depthDistortion(const format::Values& error) {
  Sums sums;
  for (std::size_t row = 0; row < kEdge; ++row) {
    for (std::size_t column = 0; column < kEdge; ++column) {
      sums.addRow(row, column, error.data() + (row * kEdge + column) * kEdge);
    }
  }
  return sums.distortion();
}

}  // namespace billow::compiler
