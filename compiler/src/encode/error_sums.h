// A candidate's errors from sums that loops over its voxels keep side by side.
#ifndef BILLOW_COMPILER_ENCODE_ERROR_SUMS_H
#define BILLOW_COMPILER_ENCODE_ERROR_SUMS_H

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "stages.h"

namespace billow::compiler {

// The least float that is not below `magnitude` >= 0, but no more than the largest finite one: a bound that is stored
// must hold.
inline float roundUp(double magnitude) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  if (!(magnitude < static_cast<double>(kLargest))) return kLargest;
  const auto nearest = static_cast<float>(magnitude);
  if (static_cast<double>(nearest) >= magnitude) return nearest;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(nearest) + 1);
}

// Sums and maxima of every eighth voxel, whatever the vectors' width, so that every machine adds in one order.
struct ErrorSums {
  static constexpr std::uint32_t kParts = 8;
  double squared[kParts] = {};
  double largest[kParts] = {};

  void setErrors(Fit& fit) const {
    fit.squaredError = 0;
    for (const double part : squared) fit.squaredError += part;
    fit.maxError = roundUp(*std::max_element(largest, largest + kParts));
  }
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_ENCODE_ERROR_SUMS_H
