// Products of turns.
#ifndef BILLOW_FORMAT_QUATERNION_H
#define BILLOW_FORMAT_QUATERNION_H

#include <array>

namespace billow::format {

using Quaternion = std::array<double, 4>;  // x y z w, of unit length

// The turn b, then a.
inline Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
          a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_QUATERNION_H
