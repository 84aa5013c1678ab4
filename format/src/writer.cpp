#include "billow/format/writer.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "billow/format/temp_file.h"
#include "hash.h"
#include "page_compressor.h"

namespace billow::format {
namespace {

constexpr std::uint32_t kMostSections = 9;
constexpr std::uint32_t kLevelSections = 2;
constexpr std::uint32_t kEffectSections = 12;

constexpr std::uint64_t aligned(std::uint64_t offset) {
  return (offset + kSectionAlignment - 1) / kSectionAlignment * kSectionAlignment;
}

// Pages are written before anybody knows whether there will be an INFO section, so room is kept for its entry.
constexpr std::uint64_t pagesOffset(const PackWriter::Options& options) {
  const std::uint32_t optional = (options.levels ? kLevelSections : 0) + (options.effects ? kEffectSections : 0);
  return aligned(sizeof(FileHeader) + (kMostSections + optional) * sizeof(SectionEntry));
}

template <class T>
std::span<const std::byte> bytesOf(const std::vector<T>& items) {
  return std::as_bytes(std::span<const T>(items));
}

}  // namespace

StringRef PackTables::addString(const std::string& text) {
  std::size_t at = strings.find(text);
  if (at == std::string::npos) {
    at = strings.size();
    strings += text;
  }
  return {static_cast<std::uint32_t>(at), static_cast<std::uint32_t>(text.size())};
}

struct PackWriter::Impl {
  Impl(std::string path, Options given)
      : options(given),
        file(std::move(path)),
        pagesBegin(pagesOffset(given)),
        compressor(given.compression, given.threads) {
    options.pageBytes = std::clamp<std::uint32_t>(options.pageBytes, 1, kMaxPageBytes);
  }

  std::uint32_t append(std::uint32_t stream, const void* items, std::uint32_t count);
  void closePage();
  void writeOldest();
  void writeSection(std::uint32_t type, std::uint32_t flags, std::span<const std::byte> bytes);
  void writeLevels(const PackTables& tables);
  void writeEffects(const EffectTables& effects);
  void writeHeader();

  Options options;
  TempFile file;
  std::uint64_t pagesBegin;
  PageCompressor compressor;
  std::array<std::vector<std::byte>, kStreamCount> open;  // the page under construction
  std::uint64_t openBytes = 0;
  std::array<std::uint32_t, kStreamCount> openFirst{};
  std::array<std::uint32_t, kStreamCount> total{};  // items appended so far
  std::vector<PageRecord> pages;                    // closed ones
  std::size_t pagesWritten = 0;
  std::uint64_t pageSectionBytes = 0;
  Hasher pageHasher;
  std::vector<SectionEntry> sections;
  std::uint64_t end = 0;
};

std::uint32_t PackWriter::Impl::append(std::uint32_t stream, const void* items, std::uint32_t count) {
  const std::uint64_t bytes = std::uint64_t{count} * kStreamItemBytes[stream];
  if (bytes > kMaxPageBytes) throw std::length_error("PackWriter: items of one call exceed the largest page");
  if (total[stream] + std::uint64_t{count} > kStreamLimit[stream]) {
    throw std::system_error(EFBIG, std::generic_category(),
                            file.path() + ": more bricks or nodes than the format can index");
  }
  if (openBytes > 0 && openBytes + bytes > options.pageBytes) closePage();
  if (count > 0) {
    const auto* first = static_cast<const std::byte*>(items);
    open[stream].insert(open[stream].end(), first, first + bytes);
    openBytes += bytes;
  }
  return std::exchange(total[stream], total[stream] + count);
}

void PackWriter::Impl::closePage() {
  if (openBytes == 0) return;
  PageRecord record{};
  record.rawSize = static_cast<std::uint32_t>(openBytes);
  std::vector<std::byte> raw;
  raw.reserve(openBytes);
  for (std::uint32_t i = 0; i < kStreamCount; ++i) {
    record.streams[i] = {openFirst[i], total[i] - openFirst[i]};
    raw.insert(raw.end(), open[i].begin(), open[i].end());
    open[i].clear();
  }
  openFirst = total;
  openBytes = 0;
  record.rawChecksum = lowHash(raw);
  pages.push_back(record);
  compressor.submit(std::move(raw), std::to_array(record.streams));
  if (compressor.full()) writeOldest();
}

void PackWriter::Impl::writeOldest() {
  const CompressedPage page = compressor.take();
  PageRecord& record = pages[pagesWritten++];
  record.offset = pageSectionBytes;
  record.checksum = hashBytes(page.stored);
  record.storedSize = static_cast<std::uint32_t>(page.stored.size());
  record.codec = static_cast<std::uint32_t>(page.codec);
  pageHasher.add(page.stored);
  file.write(pagesBegin + pageSectionBytes, page.stored);
  pageSectionBytes += page.stored.size();
}

void PackWriter::Impl::writeSection(std::uint32_t type, std::uint32_t flags, std::span<const std::byte> bytes) {
  const std::uint64_t offset = aligned(end);
  file.write(offset, bytes);
  sections.push_back({type, flags, offset, bytes.size(), hashBytes(bytes)});
  end = offset + bytes.size();
}

void PackWriter::Impl::writeLevels(const PackTables& tables) {
  if (tables.levels.empty()) return;
  if (!options.levels) throw std::logic_error("PackWriter: no room for levels");
  writeSection(kSectionLevels, 0, bytesOf(tables.levels));
  writeSection(kSectionLevelErrors, 0, bytesOf(tables.levelErrors));
}

void PackWriter::Impl::writeEffects(const EffectTables& effects) {
  const auto write = [&](std::uint32_t type, const auto& records) {
    if (!records.empty()) writeSection(type, 0, bytesOf(records));
  };
  write(kSectionEffects, effects.effects);
  write(kSectionEmitters, effects.emitters);
  write(kSectionSpans, effects.spans);
  write(kSectionMaterials, effects.materials);
  write(kSectionCurves, effects.curves);
  write(kSectionRamps, effects.ramps);
  write(kSectionCubes, effects.maps);
  write(kSectionGiven, effects.given);
  write(kSectionTracks, effects.tracks);
  write(kSectionTrackFrames, effects.trackFrames);
  write(kSectionTrackBytes, effects.trackBytes);
  write(kSectionSurfaces, effects.surfacePoints);
}

void PackWriter::Impl::writeHeader() {
  const std::span<const std::byte> contents = bytesOf(sections);
  FileHeader header{};
  std::copy(std::begin(kMagic), std::end(kMagic), header.magic);
  header.versionMajor = kVersionMajor;
  header.versionMinor = kVersionMinor;
  header.sectionCount = static_cast<std::uint32_t>(sections.size());
  header.fileSize = end;
  header.contentsOffset = sizeof(FileHeader);
  header.contentsChecksum = hashBytes(contents);
  const std::span<const std::byte> bytes = std::as_bytes(std::span(&header, 1));
  header.headerChecksum = hashBytes(bytes.first(offsetof(FileHeader, headerChecksum)));
  file.write(0, bytes);
  file.write(header.contentsOffset, contents);
}

PackWriter::PackWriter(std::string path, Options options) : impl_(std::make_unique<Impl>(std::move(path), options)) {}

PackWriter::~PackWriter() = default;

std::uint32_t PackWriter::append(Stream stream, const void* items, std::uint32_t count) {
  return impl_->append(static_cast<std::uint32_t>(stream), items, count);
}

void PackWriter::endPage() {
  impl_->closePage();
}

std::array<std::uint64_t, kStreamCount> PackWriter::itemCounts() const {
  std::array<std::uint64_t, kStreamCount> counts{};
  std::copy(impl_->total.begin(), impl_->total.end(), counts.begin());
  return counts;
}

std::uint32_t PackWriter::pageOf(Stream stream, std::uint32_t index) const {
  const auto which = static_cast<std::uint32_t>(stream);
  const auto& pages = impl_->pages;
  // The last closed page whose run begins at or before the index and isn't empty, else the open page.
  if (index >= impl_->openFirst[which]) return static_cast<std::uint32_t>(pages.size());
  const auto after =
      std::upper_bound(pages.begin(), pages.end(), index, [&](std::uint32_t value, const PageRecord& page) {
        return value < page.streams[which].first + page.streams[which].count;
      });
  return static_cast<std::uint32_t>(after - pages.begin());
}

std::uint64_t PackWriter::close(const PackTables& tables) {
  Impl& impl = *impl_;
  impl.closePage();
  while (!impl.compressor.empty()) impl.writeOldest();
  impl.sections.push_back(
      {kSectionPages, kSectionRequired, impl.pagesBegin, impl.pageSectionBytes, impl.pageHasher.digest()});
  impl.end = impl.pagesBegin + impl.pageSectionBytes;
  impl.writeSection(kSectionStrings, kSectionRequired, std::as_bytes(std::span(tables.strings)));
  impl.writeSection(kSectionVolumes, kSectionRequired, bytesOf(tables.volumes));
  impl.writeSection(kSectionGrids, kSectionRequired, bytesOf(tables.grids));
  impl.writeSection(kSectionFrames, kSectionRequired, bytesOf(tables.frames));
  impl.writeSection(kSectionGridFrames, kSectionRequired, bytesOf(tables.gridFrames));
  impl.writeSection(kSectionPageLists, kSectionRequired, bytesOf(tables.pageLists));
  impl.writeSection(kSectionPageTable, kSectionRequired, bytesOf(impl.pages));
  if (!tables.infoJson.empty()) impl.writeSection(kSectionInfo, 0, std::as_bytes(std::span(tables.infoJson)));
  impl.writeLevels(tables);
  if (!tables.effects.empty() && !impl.options.effects) throw std::logic_error("PackWriter: no room for effects");
  impl.writeEffects(tables.effects);
  impl.writeHeader();
  return impl.end;
}

void PackWriter::commit() {
  impl_->file.commit(impl_->end);
}

}  // namespace billow::format
