// A checked little-endian cursor over a file, read through a window so that only what is looked at comes into memory.
#ifndef BILLOW_COMPILER_IMPORT_BYTE_READER_H
#define BILLOW_COMPILER_IMPORT_BYTE_READER_H

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "billow/format/source.h"

namespace billow::compiler {

// Not thread-safe. Every read past the limit throws Error(Fault::input) with the file's name and the place.
class ByteReader {
 public:
  // Throws Error(Fault::file) when the file cannot be opened or is no regular file.
  explicit ByteReader(const std::string& path);

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  std::uint64_t position() const { return position_; }
  std::uint64_t remaining() const { return limit_ - position_; }

  void seek(std::uint64_t offset);
  void setLimit(std::uint64_t limit);  // of what may be read, at most size()
  void skip(std::uint64_t bytes, const char* what);
  void read(void* into, std::size_t bytes, const char* what);

  template <class T>
  T value(const char* what) {
    static_assert(std::is_trivially_copyable_v<T>);
    T result;
    read(&result, sizeof(T), what);
    return result;
  }

  // A 32-bit length and that many bytes; at most 64 KiB, longer ones are damage.
  std::string string(const char* what);

  // Throws Error(Fault::input): "PATH: damaged at byte N: DETAIL".
  [[noreturn]] void fail(const std::string& detail) const;

 private:
  void require(std::uint64_t bytes, const char* what) const;
  void fill();

  std::string path_;
  std::unique_ptr<format::ByteSource> source_;
  std::uint64_t size_ = 0;
  std::uint64_t limit_ = 0;
  std::uint64_t position_ = 0;
  std::uint64_t windowStart_ = 0;
  std::size_t windowSize_ = 0;
  std::vector<std::byte> window_;
};

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_BYTE_READER_H
