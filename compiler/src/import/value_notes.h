// Values of any type to single precision, with notes of what could not be kept.
#ifndef BILLOW_COMPILER_IMPORT_VALUE_NOTES_H
#define BILLOW_COMPILER_IMPORT_VALUE_NOTES_H

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace billow::compiler {

// Beyond this, lo + scale * texel could overflow on its way to a value.
inline constexpr double kLargestValue = 1e37;

// What is noted while values are converted; one a leaf, merged in order, so that messages do not depend on threads.
struct Notes {
  float min = 0, max = 0;
  std::uint32_t nonFinite = 0, tooLarge = 0, denormal = 0;
  std::uint32_t firstNonFinite = 0, firstTooLarge = 0;  // voxel indices
  std::uint64_t rounded = 0;                            // values that single precision does not hold exactly
  double rounding = 0;                                  // the largest difference that makes
  std::uint32_t mostRounded = 0;                        // and its voxel index

  // All but the places.
  void add(const Notes& other) {
    min = std::min(min, other.min);
    max = std::max(max, other.max);
    nonFinite += other.nonFinite;
    tooLarge += other.tooLarge;
    denormal += other.denormal;
    rounded += other.rounded;
    rounding = std::max(rounding, other.rounding);
  }
};

template <class T>
void noteRounding(T value, float result, std::uint32_t index, Notes& notes) {
  if constexpr (std::is_same_v<T, double> || (std::is_integral_v<T> && sizeof(T) >= 4)) {
    using Wide = std::conditional_t<sizeof(T) == 8 && std::is_integral_v<T>, long double, double>;
    const auto difference = static_cast<double>(std::fabs(static_cast<Wide>(value) - static_cast<Wide>(result)));
    if (difference > 0) ++notes.rounded;
    if (difference <= notes.rounding) return;
    notes.rounding = difference;
    notes.mostRounded = index;
  }
}

// Converts one value; `index` is where it stands, for the notes.
template <class T>
float convert(T value, std::uint32_t index, Notes& notes) {
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) {
      if (notes.nonFinite++ == 0) notes.firstNonFinite = index;
      return 0;
    }
    if (std::fabs(value) > static_cast<T>(kLargestValue)) {
      if (notes.tooLarge++ == 0) notes.firstTooLarge = index;
      return 0;
    }
  }
  const auto result = static_cast<float>(value);
  if (std::fabs(result) < FLT_MIN && value != T(0)) {
    ++notes.denormal;
    return 0;
  }
  noteRounding(value, result, index, notes);
  return result;
}

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_VALUE_NOTES_H
