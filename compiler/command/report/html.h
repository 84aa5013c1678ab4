// Text for a page that is HTML and well-formed XML at once.
#ifndef BILLOW_COMMAND_REPORT_HTML_H
#define BILLOW_COMMAND_REPORT_HTML_H

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace billow::command {

// For element content and for attributes in double quotes, from bytes that nobody has checked: markup is escaped, and
// what is no UTF-8, a control character or forbidden in XML becomes U+FFFD.
std::string escapeText(std::string_view text);

// Escaped, and kept from changing the writing direction of what surrounds it.
std::string nameElement(std::string_view name);

// "12.3 MB"; decimal units, as `billow info`.
std::string byteText(double bytes);

// "45.23 dB", "exact" for infinity.
std::string psnrText(double psnr);

// "1 234 567" with narrow no-break spaces.
std::string countText(std::uint64_t count);

std::string base64(std::span<const std::byte> bytes);

}  // namespace billow::command

#endif  // BILLOW_COMMAND_REPORT_HTML_H
