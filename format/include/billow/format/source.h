// Where a pack's bytes come from. Sources are never trusted and may be read from several threads at once.
#ifndef BILLOW_FORMAT_SOURCE_H
#define BILLOW_FORMAT_SOURCE_H

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "billow/format/result.h"

namespace billow::format {

class ByteSource {
 public:
  ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  virtual ~ByteSource() = default;

  virtual std::uint64_t size() const = 0;
  // Fills `into` from `offset`; false when any of it could not be read. Thread-safe.
  virtual bool read(std::uint64_t offset, std::span<std::byte> into) const = 0;
};

// Reads by pread, so a file that shrinks or fails while open gives an error, not a signal.
Result<std::unique_ptr<ByteSource>> openFileSource(const std::string& path);

inline constexpr std::uint64_t kMostTextBytes = 16u << 20;

// The whole of a file that people write (a manifest, a scene), of kMostTextBytes at most. Errors: Rule::cannotOpen,
// whose detail says why.
Result<std::string> readTextFile(const std::string& path);

std::unique_ptr<ByteSource> makeMemorySource(std::vector<std::byte> bytes);

}  // namespace billow::format

#endif  // BILLOW_FORMAT_SOURCE_H
