#include "mesh/gltf_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <optional>

#include "mesh/formats.h"

namespace billow::compiler {
namespace {

using json::Value;

constexpr std::int64_t kMostCount = std::int64_t{1} << 32;
constexpr std::int64_t kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
                       kFloat = 5126;

std::size_t sizeOf(std::int64_t type) {
  return type == kByte || type == kUnsignedByte ? 1 : type == kShort || type == kUnsignedShort ? 2 : 4;
}

template <class T>
T readAs(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

std::size_t optionalCount(const Value& of, std::string_view key, std::size_t absent) {
  const auto value = of.find(key);
  return value ? static_cast<std::size_t>(value->integer(0, kMostCount)) : absent;
}

std::optional<int> hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return std::nullopt;
}

std::string percentDecoded(const Value& uri, std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      result += text[i];
      continue;
    }
    const auto high = i + 2 < text.size() ? hexDigit(text[i + 1]) : std::nullopt;
    const auto low = high ? hexDigit(text[i + 2]) : std::nullopt;
    if (!low) uri.fail("two hexadecimal digits after each %");
    result += static_cast<char>(*high * 16 + *low);
    i += 2;
  }
  return result;
}

std::vector<std::byte> base64Decoded(const Value& uri, std::string_view text) {
  static constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  text = text.substr(0, text.find_last_not_of('=') + 1);
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) uri.fail("base64");
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> count & 255));
  }
  return bytes;
}

}  // namespace

double GltfElements::at(std::size_t index, std::size_t component) const {
  const std::byte* from = bytes.data() + index * stride + component * sizeOf(type);
  const auto scaled = [&](double value, double whole) { return normalized ? std::max(value / whole, -1.0) : value; };
  switch (type) {
    case kByte:
      return scaled(readAs<std::int8_t>(from), 127);
    case kUnsignedByte:
      return scaled(readAs<std::uint8_t>(from), 255);
    case kShort:
      return scaled(readAs<std::int16_t>(from), 32767);
    case kUnsignedShort:
      return scaled(readAs<std::uint16_t>(from), 65535);
    case kUnsignedInt:
      return readAs<std::uint32_t>(from);
    default:
      return static_cast<double>(readAs<float>(from));
  }
}

GltfData::GltfData(const Value& root, const std::string& path, std::span<const std::byte> container)
    : path_(path),
      container_(container),
      accessors_(list(root, "accessors")),
      views_(list(root, "bufferViews")),
      buffers_(list(root, "buffers")),
      loaded_(buffers_.size()) {}

std::vector<Value> GltfData::list(const Value& root, std::string_view key) {
  const auto found = root.find(key);
  return found ? found->items("a list") : std::vector<Value>{};
}

const Value& GltfData::member(const std::vector<Value>& list, const Value& number, std::string_view name) {
  if (list.empty()) number.fail(fmt::format("none: the file has no {}", name));
  return list[static_cast<std::size_t>(number.integer(0, static_cast<std::int64_t>(list.size()) - 1))];
}

GltfElements GltfData::elements(const Value& accessor, std::size_t components) {
  if (const auto sparse = accessor.find("sparse")) sparse->fail("none: sparse accessors are not read");
  GltfElements elements;
  elements.type = accessor.at("componentType").integer(kByte, kFloat);
  if (elements.type == kByte + 4) accessor.at("componentType").fail("a component type of glTF 2.0");
  elements.count = static_cast<std::size_t>(accessor.at("count").integer(1, kMostCount));
  if (const auto normalized = accessor.find("normalized")) elements.normalized = normalized->boolean();
  const Value number = accessor.at("bufferView");
  const std::span<const std::byte> bytes = view(number);
  const std::size_t size = components * sizeOf(elements.type), offset = optionalCount(accessor, "byteOffset", 0);
  elements.stride = size;
  if (const auto stride = member(views_, number, "buffer views").find("byteStride")) {
    elements.stride = static_cast<std::size_t>(stride->integer(static_cast<std::int64_t>(size), 252));
  }
  // No sum or product of these exceeds 2^41.
  if (offset + (elements.count - 1) * elements.stride + size > bytes.size()) {
    accessor.at("count").fail(fmt::format("as many elements as the {} bytes of its buffer view hold", bytes.size()));
  }
  elements.bytes = bytes.subspan(offset);
  return elements;
}

GltfElements GltfData::positions(const Value& accessor) {
  const Value& found = member(accessors_, accessor, "accessors");
  found.at("type").word({"VEC3"});
  const GltfElements result = elements(found, 3);
  if (result.type == kUnsignedInt) found.at("componentType").fail("5126, or an integer of 8 or 16 bits");
  return result;
}

GltfElements GltfData::indices(const Value& accessor) {
  const Value& found = member(accessors_, accessor, "accessors");
  found.at("type").word({"SCALAR"});
  const GltfElements result = elements(found, 1);
  if (result.type != kUnsignedByte && result.type != kUnsignedShort && result.type != kUnsignedInt) {
    found.at("componentType").fail("5121, 5123 or 5125");
  }
  return result;
}

std::span<const std::byte> GltfData::view(const Value& number) {
  const Value& found = member(views_, number, "buffer views");
  const std::span<const std::byte> bytes = buffer(found.at("buffer"));
  const std::size_t offset = optionalCount(found, "byteOffset", 0);
  const Value length = found.at("byteLength");
  const auto size = static_cast<std::size_t>(length.integer(1, kMostCount));
  if (offset + size > bytes.size()) {
    length.fail(fmt::format("a range within the {} bytes of its buffer, from {}", bytes.size(), offset));
  }
  return bytes.subspan(offset, size);
}

std::span<const std::byte> GltfData::buffer(const Value& number) {
  const Value& found = member(buffers_, number, "buffers");
  const auto index = static_cast<std::size_t>(&found - buffers_.data());
  const Value length = found.at("byteLength");
  const auto size = static_cast<std::size_t>(length.integer(1, static_cast<std::int64_t>(kMostMeshBytes)));
  std::span<const std::byte> bytes = container_;
  if (const auto uri = found.find("uri")) {
    std::vector<std::byte>& own = loaded_[index];
    if (own.empty()) {
      own = load(*uri);
      loadedBytes_ += own.size();
      if (loadedBytes_ > kMostMeshBytes) uri->fail(fmt::format("buffers of at most {} bytes together", kMostMeshBytes));
    }
    bytes = own;
  } else if (index != 0) {
    found.fail("a \"uri\": only the first buffer is the binary chunk");
  }
  if (size > bytes.size()) length.fail(fmt::format("no more than the {} bytes that are there", bytes.size()));
  return bytes.first(size);
}

// Nothing but files beside the mesh, or below, is read for it.
std::vector<std::byte> GltfData::load(const Value& uri) const {
  const std::string text = uri.text("a buffer's place");
  if (text.starts_with("data:")) {
    static constexpr std::string_view kMark = ";base64,";
    const std::size_t mark = text.find(kMark);
    if (mark == std::string::npos) uri.fail("base64");
    return base64Decoded(uri, std::string_view(text).substr(mark + kMark.size()));
  }
  const std::string name = percentDecoded(uri, text);
  const std::filesystem::path path = std::filesystem::path(name).lexically_normal();
  const bool outside = path.is_absolute() || path.begin()->string() == "..";
  if (outside || name.find(':') != std::string::npos || name.find('\0') != std::string::npos) {
    uri.fail("a path relative to the mesh's folder, and within it");
  }
  return readMeshBytes((std::filesystem::path(path_).parent_path() / path).string(), kMostMeshBytes);
}

}  // namespace billow::compiler
