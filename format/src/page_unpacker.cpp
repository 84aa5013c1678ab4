#include "billow/format/page_unpacker.h"

#define ZSTD_STATIC_LINKING_ONLY  // ZSTD_initStaticDCtx: a context in memory that is given
#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "billow/format/page_codec.h"
#include "hash.h"
#include "rules.h"

namespace billow::format {
namespace {

constexpr std::size_t kWorkAlignment = 64;

// One frame of RFC 8878 is what a page holds: the library would also take several, and frames of its first versions.
bool isOneFrame(std::span<const std::byte> stored) {
  constexpr std::array<std::byte, 4> kFrameMagic = {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f}, std::byte{0xfd}};
  return stored.size() >= kFrameMagic.size() && std::equal(kFrameMagic.begin(), kFrameMagic.end(), stored.begin()) &&
         ZSTD_findFrameCompressedSize(stored.data(), stored.size()) == stored.size();
}

tl::unexpected<Issue> broken(const Pack& pack, std::uint32_t page, Rule rule, std::string detail) {
  return tl::make_unexpected(makeIssue(rule, placeOfPage(pack, page), std::move(detail)));
}

tl::unexpected<Issue> wrongContent(const Pack& pack, std::uint32_t page) {
  return broken(pack, page, Rule::pageDecompress,
                fmt::format("It does not give the {} bytes that were written.", pack.pages()[page].rawSize));
}

Result<void> checkStored(const Pack& pack, std::uint32_t page, std::span<const std::byte> stored, bool verify) {
  const PageRecord& record = pack.pages()[page];
  if (stored.size() != record.storedSize) {
    return broken(pack, page, Rule::cannotRead, fmt::format("{} of {} bytes.", stored.size(), record.storedSize));
  }
  if (verify && hashBytes(stored) != record.checksum) {
    return broken(pack, page, Rule::pageChecksum, fmt::format("Its {} stored bytes were altered.", stored.size()));
  }
  return {};
}

}  // namespace

Place placeOfPage(const Pack& pack, std::uint32_t page) {
  Place place = PackReader::view(pack).place(kSectionPages, pack.pages()[page].offset);
  place.page = page;
  return place;
}

PageUnpacker::~PageUnpacker() {
  if (work_ != nullptr) memory_->deallocate(work_, workBytes(), kWorkAlignment);
}

std::size_t PageUnpacker::workBytes() {
  return ZSTD_estimateDCtxSize();
}

Result<void> PageUnpacker::checkRaw(const Pack& pack, std::uint32_t page, std::span<const std::byte> stored,
                                    bool verify) const {
  if (auto sound = checkStored(pack, page, stored, verify); !sound) return sound;
  const PageRecord& record = pack.pages()[page];
  // Both checksums are of the same bytes.
  if (verify && static_cast<std::uint32_t>(record.checksum) != record.rawChecksum) return wrongContent(pack, page);
  return {};
}

Result<void> PageUnpacker::unpack(const Pack& pack, std::uint32_t page, std::span<const std::byte> stored, bool verify,
                                  std::span<std::byte> content) {
  const PageRecord& record = pack.pages()[page];
  if (record.codec == static_cast<std::uint32_t>(Codec::raw)) {
    auto sound = checkRaw(pack, page, stored, verify);
    if (sound) std::memcpy(content.data(), stored.data(), stored.size());
    return sound;
  }
  if (auto sound = checkStored(pack, page, stored, verify); !sound) return sound;
  if (!decompress(record, stored, content)) return wrongContent(pack, page);
  if (verify && lowHash(content) != record.rawChecksum) return wrongContent(pack, page);
  return {};
}

bool PageUnpacker::decompress(const PageRecord& record, std::span<const std::byte> stored,
                              std::span<std::byte> content) {
  if (record.codec == static_cast<std::uint32_t>(Codec::model)) return decodePage(record.streams, stored, content);
  return decompressZstd(stored, content);
}

bool PageUnpacker::decompressZstd(std::span<const std::byte> stored, std::span<std::byte> content) {
  if (!isOneFrame(stored)) return false;
  if (work_ == nullptr) work_ = memory_->allocate(workBytes(), kWorkAlignment);
  ZSTD_DCtx* const context = ZSTD_initStaticDCtx(work_, workBytes());
  if (context == nullptr) return false;
  const std::size_t size = ZSTD_decompressDCtx(context, content.data(), content.size(), stored.data(), stored.size());
  return !ZSTD_isError(size) && size == content.size();
}

}  // namespace billow::format
