#include "import/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>
#include <utility>

#include "stages.h"

namespace billow::compiler {
namespace {

constexpr std::size_t kMostLine = 4096, kMostElements = 64, kMostProperties = 1024;

constexpr std::array<std::pair<std::string_view, PlyType>, 16> kTypes{{
    {"char", PlyType::int8},
    {"uchar", PlyType::uint8},
    {"short", PlyType::int16},
    {"ushort", PlyType::uint16},
    {"int", PlyType::int32},
    {"uint", PlyType::uint32},
    {"float", PlyType::float32},
    {"double", PlyType::float64},
    {"int8", PlyType::int8},
    {"uint8", PlyType::uint8},
    {"int16", PlyType::int16},
    {"uint16", PlyType::uint16},
    {"int32", PlyType::int32},
    {"uint32", PlyType::uint32},
    {"float32", PlyType::float32},
    {"float64", PlyType::float64},
}};

// What of a name from a file may stand in a message.
std::string shown(std::string_view text) {
  std::string clean(text.substr(0, 64));
  std::replace_if(
      clean.begin(), clean.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return clean;
}

class HeaderReader {
 public:
  HeaderReader(std::span<const std::byte> bytes, const std::string& what)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), what_(what) {}

  PlyHeader read() {
    if (line() != "ply") fail("not a PLY file");
    readFormat();
    while (true) {
      const std::string_view words = line();
      const std::string_view first = word();
      if (first == "end_header") break;
      if (first == "element") {
        readElement();
      } else if (first == "property") {
        readProperty();
      } else if (first != "comment" && first != "obj_info" && !words.empty()) {
        fail(fmt::format("line {} of its header begins with '{}'", lineNumber_, shown(first)));
      }
    }
    header_.size = at_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& detail) const {
    throw Error(Fault::input, fmt::format("{}: {}", what_, detail));
  }

  // The next line; word() then gives its words.
  std::string_view line() {
    const std::size_t end = text_.substr(0, std::min(text_.size(), at_ + kMostLine)).find('\n', at_);
    if (end == std::string_view::npos) {
      fail(lineNumber_ == 0 ? "not a PLY file" : "its header does not end (is it truncated?)");
    }
    rest_ = text_.substr(at_, end - at_);
    if (rest_.ends_with('\r')) rest_.remove_suffix(1);
    at_ = end + 1;
    ++lineNumber_;
    return rest_;
  }
  std::string_view word() {
    constexpr std::string_view kSpace = " \t";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(kSpace), rest_.size()));
    const std::string_view result = rest_.substr(0, rest_.find_first_of(kSpace));
    rest_.remove_prefix(result.size());
    return result;
  }

  void readFormat() {
    line();
    const std::string_view first = word(), encoding = word(), version = word();
    constexpr std::array<std::string_view, 3> kNames{"ascii", "binary_little_endian", "binary_big_endian"};
    const auto found = std::find(kNames.begin(), kNames.end(), encoding);
    if (first != "format" || found == kNames.end() || version != "1.0") {
      fail(fmt::format("its format is '{} {}'; expected ascii, binary_little_endian or binary_big_endian, 1.0",
                       shown(encoding), shown(version)));
    }
    header_.encoding = static_cast<PlyEncoding>(found - kNames.begin());
  }

  void readElement() {
    const std::string_view name = word(), count = word();
    PlyElement element{std::string(name), 0, {}};
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (name.empty() || error != std::errc{} || end != count.data() + count.size()) {
      fail(fmt::format("element '{}' has a count of '{}'", shown(name), shown(count)));
    }
    if (header_.elements.size() == kMostElements) fail(fmt::format("more than {} elements", kMostElements));
    header_.elements.push_back(std::move(element));
  }

  PlyType readType() {
    const std::string_view name = word();
    const auto found = std::find_if(kTypes.begin(), kTypes.end(), [&](const auto& type) { return type.first == name; });
    if (found == kTypes.end()) fail(fmt::format("a property of unknown type '{}'", shown(name)));
    return found->second;
  }

  void readProperty() {
    if (header_.elements.empty()) fail("a property before the first element");
    const std::string_view before = rest_;
    std::optional<PlyType> count;
    if (word() == "list") {
      count = readType();
      if (*count == PlyType::float32 || *count == PlyType::float64) fail("a list whose count is no integer");
    } else {
      rest_ = before;
    }
    const PlyType type = readType();
    const std::string_view name = word();
    std::vector<PlyProperty>& properties = header_.elements.back().properties;
    if (properties.size() == kMostProperties) fail(fmt::format("more than {} properties", kMostProperties));
    const bool taken = std::any_of(properties.begin(), properties.end(), [&](const auto& p) { return p.name == name; });
    if (name.empty() || taken) fail(fmt::format("a property without a name, or two named '{}'", shown(name)));
    properties.push_back({std::string(name), type, count});
  }

  std::string_view text_;
  const std::string& what_;
  PlyHeader header_{};
  std::size_t at_ = 0;
  std::string_view rest_;  // of the line
  std::size_t lineNumber_ = 0;
};

}  // namespace

std::size_t plyBytes(PlyType type) {
  constexpr std::array<std::size_t, 8> kBytes{1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

PlyHeader readPlyHeader(std::span<const std::byte> bytes, const std::string& what) {
  return HeaderReader(bytes, what).read();
}

}  // namespace billow::compiler
