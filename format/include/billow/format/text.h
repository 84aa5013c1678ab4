// What a text must be like to stand in a pack.
#ifndef BILLOW_FORMAT_TEXT_H
#define BILLOW_FORMAT_TEXT_H

#include <string_view>

namespace billow::format {

// Whether every byte belongs to a well-formed UTF-8 sequence (no overlong forms, no surrogates); "" is.
bool isUtf8(std::string_view text);

// Whether a byte is one of the control characters (below 0x20, or 0x7f) that no name may have.
constexpr bool isControl(char byte) {
  return (byte >= 0 && byte < 0x20) || byte == 0x7f;
}

}  // namespace billow::format

#endif  // BILLOW_FORMAT_TEXT_H
