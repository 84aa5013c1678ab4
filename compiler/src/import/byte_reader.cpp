#include "import/byte_reader.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "stages.h"

namespace billow::compiler {
namespace {

constexpr std::size_t kWindowBytes = 128u << 10;
constexpr std::uint32_t kLongestString = 64u << 10;

[[noreturn]] void failToRead(const std::string& path, int error) {
  throw Error(Fault::file, fmt::format("{}: cannot be read: {}", path, std::strerror(error)));
}

}  // namespace

ByteReader::ByteReader(const std::string& path) : path_(path) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) failToRead(path, errno);
  struct stat status {};
  const bool known = ::fstat(descriptor_, &status) == 0;
  const int error = known ? EINVAL : errno;
  if (!known || !S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    if (known) throw Error(Fault::file, fmt::format("{}: cannot be read: not a regular file", path));
    failToRead(path, error);
  }
  size_ = limit_ = static_cast<std::uint64_t>(status.st_size);
}

ByteReader::~ByteReader() {
  ::close(descriptor_);
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
  window_.resize(kWindowBytes);
  windowStart_ = position_;
  windowSize_ = 0;
  ssize_t got = 0;
  do {
    got = ::pread(descriptor_, window_.data(), window_.size(), static_cast<off_t>(position_));
  } while (got < 0 && errno == EINTR);
  if (got < 0) failToRead(path_, errno);
  if (got == 0) throw Error(Fault::file, fmt::format("{}: cannot be read: the file has shrunk while open", path_));
  windowSize_ = static_cast<std::size_t>(got);
}

std::string ByteReader::string(const char* what) {
  const auto length = value<std::uint32_t>(what);
  if (length > kLongestString) fail(fmt::format("{} claims to be {} bytes long", what, length));
  std::string text(length, '\0');
  read(text.data(), length, what);
  return text;
}

}  // namespace billow::compiler
