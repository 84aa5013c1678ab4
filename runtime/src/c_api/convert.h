// Between billow.h's structs and the runtime's.
#ifndef BILLOW_RUNTIME_C_API_CONVERT_H
#define BILLOW_RUNTIME_C_API_CONVERT_H

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "billow/runtime/composite.h"
#include "billow/runtime/metavoxel.h"
#include "billow/runtime/stream.h"
#include "c_api/structs.h"

namespace billow::c_api {

template <class Number, std::size_t count>
std::array<Number, count> arrayOf(const Number (&from)[count]) {
  std::array<Number, count> into;
  std::copy(from, from + count, into.begin());
  return into;
}

template <class Number, std::size_t count>
void copyArray(const std::array<Number, count>& from, Number (&into)[count]) {
  std::copy(from.begin(), from.end(), into);
}

// Cut where it is longer, at a whole character.
template <std::size_t room>
void copyName(std::string_view from, char (&into)[room]) {
  std::size_t length = std::min(from.size(), room - 1);
  if (length < from.size()) {
    while (length > 0 && (static_cast<unsigned char>(from[length]) & 0xc0u) == 0x80u) --length;
  }
  std::memcpy(into, from.data(), length);
  into[length] = 0;
}

// An enumerator, where the number is one of the first `count`; `field` names it.
template <class To, class From>
Outcome<To> enumerator(From from, int count, const char* field) {
  const int number = static_cast<int>(from);
  if (number < 0 || number >= count) return badArgument(std::string(field) + " is " + std::to_string(number));
  return static_cast<To>(number);
}

// Whether it is finite and can be turned round.
bool soundTransform(const std::array<double, 12>& matrix);

Outcome<runtime::View> viewOf(const BillowView* view);  // NULL is an error
Outcome<runtime::Sun> sunOf(const BillowSun* sun);
Outcome<runtime::Quality> qualityOf(const BillowQuality* quality);
Outcome<runtime::Background> backgroundOf(const BillowBackground* background);
Outcome<runtime::Look> lookOf(const BillowLook* look);
Outcome<runtime::Playback> playbackOf(const BillowPlayback* playback);
Outcome<runtime::SceneShadow> shadowOf(const BillowShadowMap* map);  // NULL: none
Outcome<runtime::ColorFormat> colorFormatOf(BillowColorFormat format, const char* field);
BillowLook lookOf(const runtime::Look& look);

}  // namespace billow::c_api

#endif  // BILLOW_RUNTIME_C_API_CONVERT_H
