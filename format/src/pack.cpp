#include "billow/format/pack.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "guard.h"
#include "hash.h"
#include "rules.h"

namespace billow::format {
namespace {

constexpr std::uint64_t kTableLimit = std::uint64_t{1} << 30;

Place sectionPlace(const SectionEntry& entry) {
  Place place;
  place.section = sectionName(entry.type);
  place.offset = entry.offset;
  return place;
}

const SectionEntry* findSection(std::span<const SectionEntry> sections, std::uint32_t type) {
  const auto found =
      std::find_if(sections.begin(), sections.end(), [&](const SectionEntry& entry) { return entry.type == type; });
  return found == sections.end() ? nullptr : &*found;
}

// Reads one table whole; leaves it empty where that is not possible. A missing one was reported with the contents.
template <class Table>
void readTable(const ByteSource& source, std::span<const SectionEntry> sections, std::uint32_t type, Table& table,
               IssueSink& sink) {
  const SectionEntry* entry = findSection(sections, type);
  if (entry == nullptr || sink.stopped()) return;
  const Place place = sectionPlace(*entry);
  constexpr std::uint64_t kRecord = sizeof(typename Table::value_type);
  if (entry->size % kRecord != 0 || entry->size / kRecord > std::numeric_limits<std::uint32_t>::max()) {
    return sink.report(Rule::tableSize, place, fmt::format("{} bytes in records of {}.", entry->size, kRecord));
  }
  if (entry->size > kTableLimit) {
    return sink.report(Rule::tableLimit, place, fmt::format("It has {} bytes.", entry->size));
  }
  table.resize(entry->size / kRecord);
  const std::span<std::byte> bytes = std::as_writable_bytes(std::span(table.data(), table.size()));
  if (!source.read(entry->offset, bytes)) {
    table.clear();
    return sink.report(Rule::cannotRead, place, fmt::format("{} bytes cannot be read.", bytes.size()));
  }
  if (hashBytes(bytes) != entry->checksum) {
    sink.report(Rule::sectionChecksum, place, fmt::format("Its {} bytes were altered.", bytes.size()));
  }
}

void readEffects(const ByteSource& source, std::span<const SectionEntry> sections, EffectTables& effects,
                 IssueSink& sink) {
  readTable(source, sections, kSectionEffects, effects.effects, sink);
  readTable(source, sections, kSectionEmitters, effects.emitters, sink);
  readTable(source, sections, kSectionSpans, effects.spans, sink);
  readTable(source, sections, kSectionMaterials, effects.materials, sink);
  readTable(source, sections, kSectionCurves, effects.curves, sink);
  readTable(source, sections, kSectionRamps, effects.ramps, sink);
  readTable(source, sections, kSectionCubes, effects.maps, sink);
  readTable(source, sections, kSectionGiven, effects.given, sink);
  readTable(source, sections, kSectionTracks, effects.tracks, sink);
  readTable(source, sections, kSectionTrackFrames, effects.trackFrames, sink);
  readTable(source, sections, kSectionTrackBytes, effects.trackBytes, sink);
  readTable(source, sections, kSectionSurfaces, effects.surfacePoints, sink);
}

}  // namespace

bool PackReader::read(std::unique_ptr<ByteSource> source, Pack& pack, FileHeader& header, IssueSink& sink) {
  const std::uint64_t before = sink.errors();
  pack.source_ = std::move(source);
  const ByteSource& bytes = *pack.source_;
  if (!checkHeader(bytes, header, sink)) return false;
  if (!readContents(bytes, header, pack.sections_, sink)) return false;
  checkContents(bytes, pack.sections_, sink);
  readTable(bytes, pack.sections_, kSectionStrings, pack.strings_, sink);
  readTable(bytes, pack.sections_, kSectionVolumes, pack.volumes_, sink);
  readTable(bytes, pack.sections_, kSectionGrids, pack.grids_, sink);
  readTable(bytes, pack.sections_, kSectionFrames, pack.frames_, sink);
  readTable(bytes, pack.sections_, kSectionGridFrames, pack.gridFrames_, sink);
  readTable(bytes, pack.sections_, kSectionPageLists, pack.pageLists_, sink);
  readTable(bytes, pack.sections_, kSectionPageTable, pack.pages_, sink);
  readTable(bytes, pack.sections_, kSectionLevels, pack.levels_, sink);
  readTable(bytes, pack.sections_, kSectionLevelErrors, pack.levelErrors_, sink);
  readEffects(bytes, pack.sections_, pack.effects_, sink);
  if (sink.stopped()) return false;
  checkTables(view(pack), sink);
  checkPageTable(view(pack), sink);
  if (sink.errors() == before) checkLevels(view(pack), sink);
  checkEffects(view(pack), sink);
  if (checkTracks(view(pack), sink)) loadTracks(view(pack), pack.effects_, sink);
  if (sink.errors() != before) return false;
  pack.isLevel_.resize(pack.volumes_.size());
  for (const LevelRecord& level : pack.levels_) pack.isLevel_[level.level] = true;
  return true;
}

TableView PackReader::view(const Pack& pack) {
  return {pack.sections_,  pack.strings_, pack.volumes_, pack.grids_,       pack.frames_,  pack.gridFrames_,
          pack.pageLists_, pack.pages_,   pack.levels_,  pack.levelErrors_, &pack.effects_};
}

Result<Pack> Pack::open(std::unique_ptr<ByteSource> source) {
  return guarded<Pack>([&]() -> Result<Pack> {
    Pack pack;
    FileHeader header{};
    FirstError sink;
    if (!PackReader::read(std::move(source), pack, header, sink)) return tl::make_unexpected(std::move(sink.issue()));
    return pack;
  });
}

Result<Pack> Pack::openFile(const std::string& path) {
  return guarded<Pack>([&]() -> Result<Pack> {
    Result<std::unique_ptr<ByteSource>> source = openFileSource(path);
    if (!source) return tl::make_unexpected(std::move(source.error()));
    return open(std::move(*source));
  });
}

std::span<const std::byte> Page::stream(const PageRecord& record, Stream which) const {
  std::size_t offset = 0;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(which); ++i) {
    offset += std::size_t{record.streams[i].count} * kStreamItemBytes[i];
  }
  const auto stream = static_cast<std::uint32_t>(which);
  return std::span(raw).subspan(offset, std::size_t{record.streams[stream].count} * kStreamItemBytes[stream]);
}

std::string_view Pack::string(StringRef ref) const {
  return std::string_view(strings_).substr(ref.offset, ref.size);
}

std::uint64_t Pack::fileSize() const {
  return source_->size();
}

std::span<const GridRecord> Pack::gridsOf(const VolumeRecord& volume) const {
  return grids().subspan(volume.firstGrid, volume.gridCount);
}

std::span<const FrameRecord> Pack::framesOf(const VolumeRecord& volume) const {
  return frames().subspan(volume.firstFrame, volume.frameCount);
}

const GridFrame& Pack::gridFrame(const VolumeRecord& volume, std::uint32_t frame, std::uint32_t grid) const {
  return gridFrames_[volume.firstGridFrame + std::size_t{frame} * volume.gridCount + grid];
}

std::span<const LevelRecord> Pack::levelsOf(std::uint32_t volume) const {
  const auto before = [](const LevelRecord& level, std::uint32_t number) { return level.volume < number; };
  const auto begin = std::lower_bound(levels_.begin(), levels_.end(), volume, before);
  const auto end = std::lower_bound(begin, levels_.end(), volume + 1, before);
  return {begin, end};
}

const LevelError& Pack::levelError(const LevelRecord& level, std::uint32_t frame, std::uint32_t grid) const {
  return levelErrors_[level.firstError + std::size_t{frame} * volumes_[level.level].gridCount + grid];
}

std::span<const std::uint32_t> Pack::pagesOf(const GridFrame& gridFrame) const {
  return pageLists().subspan(gridFrame.pageListBegin, gridFrame.pageListCount);
}

Result<std::string> Pack::infoJson() const {
  return guarded<std::string>([&]() -> Result<std::string> {
    std::string text;
    FirstError sink;
    readTable(*source_, sections_, kSectionInfo, text, sink);
    if (sink.errors() == 0 && !isUtf8(text)) {
      sink.report(Rule::infoUtf8, sectionPlace(*findSection(sections_, kSectionInfo)), "It is not.");
    }
    if (sink.errors() > 0) return tl::make_unexpected(std::move(sink.issue()));
    return text;
  });
}

Result<Page> Pack::readPage(std::uint32_t number) const {
  return guarded<Page>([&]() -> Result<Page> {
    Page page;
    FirstError sink;
    if (!loadPage(*this, number, page, sink)) return tl::make_unexpected(std::move(sink.issue()));
    return page;
  });
}

}  // namespace billow::format
