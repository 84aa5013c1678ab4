// Stored pages to their content, on memory of the caller's: what a loader does some thousand times a second.
#ifndef BILLOW_FORMAT_PAGE_UNPACKER_H
#define BILLOW_FORMAT_PAGE_UNPACKER_H

#include <cstddef>
#include <memory_resource>
#include <span>

#include "billow/format/pack.h"

namespace billow::format {

// Where a page lies in the file: section, byte and number. `page` must be the pack's.
Place placeOfPage(const Pack& pack, std::uint32_t page);

// Keeps what decompressors need from page to page. One thread at a time.
class PageUnpacker {
 public:
  // Takes workBytes() of `memory` when it meets the first zstd page. The codec `model` keeps its models, about 1 MB a
  // thread, on the heap.
  explicit PageUnpacker(std::pmr::memory_resource* memory) : memory_(memory) {}
  PageUnpacker(const PageUnpacker&) = delete;
  PageUnpacker& operator=(const PageUnpacker&) = delete;
  ~PageUnpacker();

  static std::size_t workBytes();

  // Fills `content`, which has the record's rawSize bytes, from `stored`, which may be any bytes. Without `verify` the
  // checksums of both are not compared: the content may then be anything. Throws std::bad_alloc of `memory`.
  Result<void> unpack(const Pack& pack, std::uint32_t page, std::span<const std::byte> stored, bool verify,
                      std::span<std::byte> content);
  // What unpack() says of a page with codec raw, whose content are its stored bytes.
  Result<void> checkRaw(const Pack& pack, std::uint32_t page, std::span<const std::byte> stored, bool verify) const;

 private:
  bool decompress(const PageRecord& record, std::span<const std::byte> stored, std::span<std::byte> content);
  bool decompressZstd(std::span<const std::byte> stored, std::span<std::byte> content);

  std::pmr::memory_resource* memory_;
  void* work_ = nullptr;
};

}  // namespace billow::format

#endif  // BILLOW_FORMAT_PAGE_UNPACKER_H
