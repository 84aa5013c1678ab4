#include "report/html.h"

#include <fmt/format.h>

#include <cmath>

#include "billow/format/text.h"

namespace billow::command {
namespace {

constexpr std::string_view kReplacement = "\xef\xbf\xbd";  // U+FFFD

// Bytes of the well-formed UTF-8 sequence that `text` begins with; 0 where there is none.
std::size_t sequenceSize(std::string_view text) {
  for (std::size_t size = 1; size <= 4 && size <= text.size(); ++size) {
    if (format::isUtf8(text.substr(0, size))) return size;
  }
  return 0;
}

// C1 controls, and the two that XML leaves out.
bool isForbidden(std::string_view sequence) {
  if (sequence.size() == 2) return sequence[0] == '\xc2' && static_cast<unsigned char>(sequence[1]) < 0xa0;
  return sequence == "\xef\xbf\xbe" || sequence == "\xef\xbf\xbf";
}

std::string_view escaped(std::string_view sequence) {
  if (sequence.empty() || isForbidden(sequence)) return kReplacement;
  if (sequence.size() > 1) return sequence;
  if (format::isControl(sequence[0])) return kReplacement;
  switch (sequence[0]) {
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '&':
      return "&amp;";
    case '"':
      return "&quot;";
    default:
      return sequence;
  }
}

}  // namespace

std::string escapeText(std::string_view text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = sequenceSize(text.substr(at));
    result += escaped(text.substr(at, size));
    at += size == 0 ? 1 : size;
  }
  return result;
}

std::string nameElement(std::string_view name) {
  return fmt::format("<bdi>{}</bdi>", escapeText(name));
}

std::string byteText(double bytes) {
  if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
  if (bytes < 1e6) return fmt::format("{:.1f} kB", bytes * 1e-3);
  if (bytes < 1e9) return fmt::format("{:.2f} MB", bytes * 1e-6);
  return fmt::format("{:.2f} GB", bytes * 1e-9);
}

std::string psnrText(double psnr) {
  if (std::isfinite(psnr)) return fmt::format("{:.2f} dB", psnr);
  return psnr > 0 ? "exact" : "no range";
}

std::string countText(std::uint64_t count) {
  std::string text = fmt::format("{}", count);
  for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, "\xe2\x80\xaf");
  return text;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    std::uint32_t group = 0;
    for (std::size_t b = 0; b < 3; ++b) {
      group = group << 8 | (at + b < bytes.size() ? std::to_integer<std::uint32_t>(bytes[at + b]) : 0);
    }
    for (std::size_t d = 0; d < 4; ++d) {
      text += at + d <= bytes.size() ? kDigits[group >> (18 - 6 * d) & 63] : '=';
    }
  }
  return text;
}

}  // namespace billow::command
