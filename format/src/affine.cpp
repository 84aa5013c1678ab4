#include "billow/format/affine.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace billow::format {

double determinant(const double (&m)[12]) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
}

bool invertible(const double (&m)[12]) {
  if (!std::all_of(std::begin(m), std::end(m), [](double value) { return std::isfinite(value); })) return false;
  const double whole = determinant(m);
  return std::isfinite(whole) && whole != 0 && std::isfinite(1 / whole);
}

void invert(const double (&m)[12], double (&inverse)[12]) {
  const auto minor = [&m](int r0, int r1, int c0, int c1) {
    return m[r0 * 4 + c0] * m[r1 * 4 + c1] - m[r0 * 4 + c1] * m[r1 * 4 + c0];
  };
  const double cofactors[9] = {minor(1, 2, 1, 2),  -minor(0, 2, 1, 2), minor(0, 1, 1, 2),
                               -minor(1, 2, 0, 2), minor(0, 2, 0, 2),  -minor(0, 1, 0, 2),
                               minor(1, 2, 0, 1),  -minor(0, 2, 0, 1), minor(0, 1, 0, 1)};
  const double whole = determinant(m);
  for (int row = 0; row < 3; ++row) {
    double translation = 0;
    for (int column = 0; column < 3; ++column) {
      const double value = cofactors[row * 3 + column] / whole;
      inverse[row * 4 + column] = value;
      translation -= value * m[column * 4 + 3];
    }
    inverse[row * 4 + 3] = translation;
  }
}

void compose(std::span<const double, 12> outer, const double (&inner)[12], double (&product)[12]) {
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      double sum = column == 3 ? outer[row * 4 + 3] : 0;
      for (std::size_t i = 0; i < 3; ++i) sum += outer[row * 4 + i] * inner[i * 4 + column];
      product[row * 4 + column] = sum;
    }
  }
}

}  // namespace billow::format
