#include "import/byte_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "stages.h"

namespace billow::compiler {
namespace {

constexpr std::size_t kWindowBytes = 128u << 10;
constexpr std::uint32_t kLongestString = 64u << 10;

[[noreturn]] void failToRead(const std::string& path, const std::string& detail) {
  throw Error(Fault::file, fmt::format("{}: cannot be read: {}", path, detail));
}

}  // namespace

ByteReader::ByteReader(const std::string& path) : path_(path) {
  auto source = format::openFileSource(path);
  if (!source) failToRead(path, source.error().detail);
  source_ = std::move(*source);
  size_ = limit_ = source_->size();
}

void ByteReader::fail(const std::string& detail) const {
  throw Error(Fault::input, fmt::format("{}: damaged at byte {}: {}", path_, position_, detail));
}

void ByteReader::require(std::uint64_t bytes, const char* what) const {
  if (bytes <= remaining()) return;
  fail(fmt::format("{} needs {} bytes, and only {} are left{}", what, bytes, remaining(),
                   limit_ == size_ ? " in the file (is it truncated?)" : " before its end"));
}

void ByteReader::seek(std::uint64_t offset) {
  position_ = 0;
  require(offset, "an offset");
  position_ = offset;
}

void ByteReader::setLimit(std::uint64_t limit) {
  limit_ = std::min(limit, size_);
}

void ByteReader::skip(std::uint64_t bytes, const char* what) {
  require(bytes, what);
  position_ += bytes;
}

void ByteReader::read(void* into, std::size_t bytes, const char* what) {
  require(bytes, what);
  auto* out = static_cast<std::byte*>(into);
  while (bytes > 0) {
    if (position_ < windowStart_ || position_ >= windowStart_ + windowSize_) fill();
    const std::size_t at = static_cast<std::size_t>(position_ - windowStart_);
    const std::size_t count = std::min(bytes, windowSize_ - at);
    std::memcpy(out, window_.data() + at, count);
    out += count;
    bytes -= count;
    position_ += count;
  }
}

void ByteReader::fill() {
  window_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kWindowBytes, size_ - position_)));
  windowStart_ = position_;
  windowSize_ = 0;
  if (!source_->read(position_, window_)) {
    failToRead(path_, fmt::format("{} bytes at {} (has the file shrunk while open?)", window_.size(), position_));
  }
  windowSize_ = window_.size();
}

std::string ByteReader::string(const char* what) {
  const auto length = value<std::uint32_t>(what);
  if (length > kLongestString) fail(fmt::format("{} claims to be {} bytes long", what, length));
  std::string text(length, '\0');
  read(text.data(), length, what);
  return text;
}

}  // namespace billow::compiler
