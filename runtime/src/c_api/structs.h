// Structs of billow.h across versions: what an older or newer host gives, and what is given back.
#ifndef BILLOW_RUNTIME_C_API_STRUCTS_H
#define BILLOW_RUNTIME_C_API_STRUCTS_H

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "c_api/problem.h"

namespace billow::c_api {

// A struct of more bytes than any version will have comes without a size.
inline constexpr std::uint32_t kMostStructBytes = 1u << 16;

template <class T>
struct Struct;  // name and defaults of T

#define BILLOW_STRUCT(Type, DEFAULT)                \
  template <>                                       \
  struct Struct<Type> {                             \
    static constexpr const char* kName = #Type;     \
    static constexpr const char* kBegin = #DEFAULT; \
    static Type defaults() {                        \
      const Type value = DEFAULT;                   \
      return value;                                 \
    }                                               \
  };
#define BILLOW_STRUCT_OF(Type, WORDS) BILLOW_STRUCT(Type, BILLOW_##WORDS##_DEFAULT)
BILLOW_STRUCT_OF(BillowAllocator, ALLOCATOR)
BILLOW_STRUCT_OF(BillowBackground, BACKGROUND)
BILLOW_STRUCT_OF(BillowCompositeInfo, COMPOSITE_INFO)
BILLOW_STRUCT_OF(BillowConfig, CONFIG)
BILLOW_STRUCT_OF(BillowDevice, DEVICE)
BILLOW_STRUCT_OF(BillowDrawInfo, DRAW_INFO)
BILLOW_STRUCT_OF(BillowEffect, EFFECT)
BILLOW_STRUCT_OF(BillowEffectInfo, EFFECT_INFO)
BILLOW_STRUCT_OF(BillowFile, FILE)
BILLOW_STRUCT_OF(BillowInstanceInfo, INSTANCE_INFO)
BILLOW_STRUCT_OF(BillowInstanceState, INSTANCE_STATE)
BILLOW_STRUCT_OF(BillowJobs, JOBS)
BILLOW_STRUCT_OF(BillowLog, LOG)
BILLOW_STRUCT_OF(BillowLook, LOOK)
BILLOW_STRUCT_OF(BillowOpenInfo, OPEN_INFO)
BILLOW_STRUCT_OF(BillowPackInfo, PACK_INFO)
BILLOW_STRUCT_OF(BillowPlayback, PLAYBACK)
BILLOW_STRUCT_OF(BillowQuality, QUALITY)
BILLOW_STRUCT_OF(BillowScattering, SCATTERING)
BILLOW_STRUCT_OF(BillowShadowMap, SHADOW_MAP)
BILLOW_STRUCT_OF(BillowSpaceInfo, SPACE_INFO)
BILLOW_STRUCT_OF(BillowSun, SUN)
BILLOW_STRUCT_OF(BillowUpdateInfo, UPDATE_INFO)
BILLOW_STRUCT_OF(BillowView, VIEW)
BILLOW_STRUCT_OF(BillowVolumeInfo, VOLUME_INFO)
#undef BILLOW_STRUCT_OF
#undef BILLOW_STRUCT

// The struct as this version has it: defaults for what an older host's lacks. What a newer one's has beyond must be
// zero.
template <class T>
Outcome<T> given(const T* from) {
  const std::string name = Struct<T>::kName;
  if (from == nullptr) return badArgument(name + " is NULL");
  std::uint32_t size = 0;
  std::memcpy(&size, from, sizeof(size));
  if (size < sizeof(size) || size > kMostStructBytes) {
    return badArgument(name + "::size is " + std::to_string(size) + "; begin with " + Struct<T>::kBegin);
  }
  const auto* bytes = reinterpret_cast<const std::byte*>(from);
  if (size > sizeof(T) && std::any_of(bytes + sizeof(T), bytes + size, [](std::byte b) { return b != std::byte{0}; })) {
    return badArgument(name + " uses fields that this version of billow does not have");
  }
  T value = Struct<T>::defaults();
  // Every version's size is a multiple of the alignment: no field is taken in part.
  std::memcpy(&value, from, std::min<std::size_t>(size - size % alignof(T), sizeof(T)));
  value.size = sizeof(T);
  return value;
}

template <class T>
Outcome<T> givenOrDefault(const T* from) {
  return from == nullptr ? Outcome<T>(Struct<T>::defaults()) : given(from);
}

// The i-th of an array of structs of the host's size.
template <class T>
Outcome<T> givenAt(const T* first, std::uint32_t i) {
  std::uint32_t size = 0;
  if (first != nullptr) std::memcpy(&size, first, sizeof(size));
  return given(first == nullptr
                   ? first
                   : reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(first) + std::size_t{size} * i));
}

// As much of `value` as the host's struct has room for; its size stays. Without a size, or NULL: nothing is done.
template <class T>
bool giveBack(const T& value, T* into) {
  if (into == nullptr || into->size < sizeof(into->size) || into->size > kMostStructBytes) return false;
  const std::size_t size = std::min<std::size_t>(into->size, sizeof(T)) - sizeof(into->size);
  std::memcpy(reinterpret_cast<std::byte*>(into) + sizeof(into->size),
              reinterpret_cast<const std::byte*>(&value) + sizeof(into->size), size);
  return true;
}

// The same where the function can say that it did not.
template <class T>
Outcome<void> answer(const T& value, T* into) {
  if (giveBack(value, into)) return {};
  return badArgument(std::string(Struct<T>::kName) + " is NULL or without a size; begin with " + Struct<T>::kBegin);
}

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_STRUCTS_H
