// The fields of a LookRecord by name, in the order of their bits of `set`, with the ranges that the standard gives
// them.
#ifndef BILLOW_FORMAT_LOOK_H
#define BILLOW_FORMAT_LOOK_H

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <span>
#include <string_view>

#include "billow/format/layout.h"

namespace billow::format {

struct LookField {
  std::string_view name;
  std::size_t offset;  // within the record, in bytes
  std::size_t count;   // of floats
  float low, high;     // each in [low, high], or strictly between them where `open`
  bool open = false;

  constexpr bool holds(float value) const { return open ? value > low && value < high : value >= low && value <= high; }
};

inline constexpr float kLargestLook = std::numeric_limits<float>::max();

inline constexpr LookField kLookFields[] = {
    {"extinctionScale", offsetof(LookRecord, extinctionScale), 1, 0, kLargestLook},
    {"albedo", offsetof(LookRecord, albedo), 3, 0, 1},
    {"anisotropy", offsetof(LookRecord, anisotropy), 1, -1, 1, true},
    {"emissionScale", offsetof(LookRecord, emissionScale), 1, 0, kLargestLook},
    {"temperatureScale", offsetof(LookRecord, temperatureScale), 1, -kLargestLook, kLargestLook},
    {"temperatureOffset", offsetof(LookRecord, temperatureOffset), 1, -kLargestLook, kLargestLook},
    {"ambient", offsetof(LookRecord, ambient), 3, 0, kLargestLook},
};

// Numbers in kLookFields, and bits of `set`.
enum LookBit : std::uint32_t {
  kLookExtinctionScale,
  kLookAlbedo,
  kLookAnisotropy,
  kLookEmissionScale,
  kLookTemperatureScale,
  kLookTemperatureOffset,
  kLookAmbient,
  kLookFieldCount
};
static_assert(std::size(kLookFields) == kLookFieldCount);

constexpr bool isSet(const LookRecord& look, std::uint32_t field) {
  return (look.set >> field & 1u) != 0;
}

// A field's floats.
inline std::span<const float> lookValues(const LookRecord& look, std::uint32_t field) {
  const auto* bytes = reinterpret_cast<const std::byte*>(&look) + kLookFields[field].offset;
  return {reinterpret_cast<const float*>(bytes), kLookFields[field].count};
}

// Gives a field its value, and sets its bit. `values` are as many as the field has.
inline void setLook(LookRecord& look, std::uint32_t field, std::span<const float> values) {
  auto* bytes = reinterpret_cast<std::byte*>(&look) + kLookFields[field].offset;
  for (std::size_t i = 0; i < kLookFields[field].count; ++i) reinterpret_cast<float*>(bytes)[i] = values[i];
  look.set |= 1u << field;
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_LOOK_H
