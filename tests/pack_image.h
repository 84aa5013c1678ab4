// A pack taken apart into its tables and raw pages, to be changed at will and put together again with every checksum
// right: so that a test (or a fuzzer) reaches the rules behind the checksums. Written apart from PackWriter.
#ifndef BILLOW_TESTS_PACK_IMAGE_H
#define BILLOW_TESTS_PACK_IMAGE_H

#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "billow/format/pack.h"

namespace billow::tests {

inline std::uint64_t checksum(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

template <class T>
void putAt(std::vector<std::byte>& bytes, std::size_t offset, const T& value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}
template <class T>
T getAt(const std::vector<std::byte>& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

// Makes the checksums of contents and header match their bytes.
inline void sealHeader(std::vector<std::byte>& bytes) {
  auto header = getAt<format::FileHeader>(bytes, 0);
  const std::size_t contents = header.sectionCount * sizeof(format::SectionEntry);
  if (header.contentsOffset == sizeof header && contents <= bytes.size() - sizeof header) {
    header.contentsChecksum = checksum(std::span(bytes).subspan(sizeof header, contents));
  }
  header.headerChecksum = checksum(std::as_bytes(std::span(&header, 1)).first(56));
  putAt(bytes, 0, header);
}

// Makes every checksum match its bytes, as far as the contents can be followed.
inline void sealAll(std::vector<std::byte>& bytes) {
  if (bytes.size() < sizeof(format::FileHeader)) return;
  auto header = getAt<format::FileHeader>(bytes, 0);
  std::memcpy(header.magic, format::kMagic, sizeof header.magic);
  header.versionMajor = format::kVersionMajor;
  header.fileSize = bytes.size();
  putAt(bytes, 0, header);
  const std::size_t entries = (bytes.size() - sizeof header) / sizeof(format::SectionEntry);
  const std::size_t count = std::min<std::size_t>({header.sectionCount, entries, format::kMaxSections});
  const auto inside = [&](std::uint64_t offset, std::uint64_t size) {
    return offset <= bytes.size() && size <= bytes.size() - offset;
  };
  format::SectionEntry pages{};
  // The page table before the sections: it is one of them.
  for (int pass = 0; pass < 3; ++pass) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = sizeof header + i * sizeof(format::SectionEntry);
      auto entry = getAt<format::SectionEntry>(bytes, at);
      if (!inside(entry.offset, entry.size)) continue;
      if (pass == 0 && entry.type == format::kSectionPages) pages = entry;
      for (std::size_t p = 0; pass == 1 && entry.type == format::kSectionPageTable && p + 80 <= entry.size; p += 80) {
        auto record = getAt<format::PageRecord>(bytes, entry.offset + p);
        if (record.offset > pages.size || record.storedSize > pages.size - record.offset) continue;
        record.checksum = checksum(std::span(bytes).subspan(pages.offset + record.offset, record.storedSize));
        if (record.codec == 0) record.rawChecksum = static_cast<std::uint32_t>(record.checksum);
        putAt(bytes, entry.offset + p, record);
      }
      if (pass < 2) continue;
      entry.checksum = checksum(std::span(bytes).subspan(entry.offset, entry.size));
      putAt(bytes, at, entry);
    }
  }
  sealHeader(bytes);
}

struct PackImage {
  std::vector<format::VolumeRecord> volumes;
  std::vector<format::GridRecord> grids;
  std::vector<format::FrameRecord> frames;
  std::vector<format::GridFrame> gridFrames;
  std::vector<std::uint32_t> pageLists;
  std::vector<format::PageRecord> pageRecords;  // as they will be stored, but for offset, checksum, sizes and codec
  std::vector<std::vector<std::byte>> pages;    // raw
  std::vector<format::LevelRecord> levels;
  std::vector<format::LevelError> levelErrors;
  std::string strings;
  std::string info;

  // The pack must be sound.
  static PackImage of(std::vector<std::byte> bytes) {
    const auto pack = *format::Pack::open(format::makeMemorySource(std::move(bytes)));
    PackImage image;
    const auto copy = [](auto& to, auto from) { to.assign(from.begin(), from.end()); };
    copy(image.volumes, pack.volumes());
    copy(image.grids, pack.grids());
    copy(image.frames, pack.frames());
    copy(image.gridFrames, pack.gridFrames());
    copy(image.pageLists, pack.pageLists());
    copy(image.pageRecords, pack.pages());
    copy(image.levels, pack.levels());
    const auto read = [&](std::uint32_t type, auto& into) {
      for (const format::SectionEntry& section : pack.sections()) {
        if (section.type != type) continue;
        into.resize(section.size / sizeof(into[0]));
        pack.source().read(section.offset, std::as_writable_bytes(std::span(into)));
      }
    };
    read(format::kSectionStrings, image.strings);
    read(format::kSectionLevelErrors, image.levelErrors);
    image.info = *pack.infoJson();
    for (std::uint32_t i = 0; i < image.pageRecords.size(); ++i) image.pages.push_back(pack.readPage(i)->raw);
    return image;
  }

  // An item of a page; the page of the first item of the stream where `page` is not given.
  template <class T>
  T* item(format::Stream stream, std::uint32_t index) {
    for (std::size_t p = 0; p < pages.size(); ++p) {
      std::size_t offset = 0;
      for (std::uint32_t s = 0; s < static_cast<std::uint32_t>(stream); ++s) {
        offset += std::size_t{pageRecords[p].streams[s].count} * format::kStreamItemBytes[s];
      }
      const format::StreamRange& run = pageRecords[p].streams[static_cast<std::uint32_t>(stream)];
      if (index < run.first || index - run.first >= run.count) continue;
      return reinterpret_cast<T*>(pages[p].data() + offset) + (index - run.first);
    }
    return nullptr;
  }

  std::vector<std::byte> assemble() const {
    std::vector<format::PageRecord> records = pageRecords;
    std::vector<std::byte> content;
    for (std::size_t i = 0; i < pages.size(); ++i) {
      records[i].offset = content.size();
      records[i].storedSize = static_cast<std::uint32_t>(pages[i].size());
      records[i].rawSize = records[i].storedSize;
      records[i].codec = static_cast<std::uint32_t>(format::Codec::raw);
      records[i].checksum = checksum(pages[i]);
      records[i].rawChecksum = static_cast<std::uint32_t>(records[i].checksum);
      content.insert(content.end(), pages[i].begin(), pages[i].end());
    }
    return assemble(content, records);
  }

  // The same with the page section and table as given.
  std::vector<std::byte> assemble(std::span<const std::byte> content,
                                  const std::vector<format::PageRecord>& records) const {
    const auto bytesOf = [](const auto& items) { return std::as_bytes(std::span(items)); };
    struct Section {
      std::uint32_t type, flags;
      std::span<const std::byte> bytes;
    };
    std::vector<Section> sections = {{format::kSectionPages, 1, content},
                                     {format::kSectionStrings, 1, bytesOf(strings)},
                                     {format::kSectionVolumes, 1, bytesOf(volumes)},
                                     {format::kSectionGrids, 1, bytesOf(grids)},
                                     {format::kSectionFrames, 1, bytesOf(frames)},
                                     {format::kSectionGridFrames, 1, bytesOf(gridFrames)},
                                     {format::kSectionPageLists, 1, bytesOf(pageLists)},
                                     {format::kSectionPageTable, 1, bytesOf(records)}};
    if (!info.empty()) sections.push_back({format::kSectionInfo, 0, bytesOf(info)});
    if (!levels.empty()) sections.push_back({format::kSectionLevels, 0, bytesOf(levels)});
    if (!levelErrors.empty()) sections.push_back({format::kSectionLevelErrors, 0, bytesOf(levelErrors)});
    std::vector<std::byte> out(sizeof(format::FileHeader) + sections.size() * sizeof(format::SectionEntry));
    for (std::size_t i = 0; i < sections.size(); ++i) {
      const Section& section = sections[i];
      out.resize((out.size() + 63) / 64 * 64);
      putAt(
          out, sizeof(format::FileHeader) + i * sizeof(format::SectionEntry),
          format::SectionEntry{section.type, section.flags, out.size(), section.bytes.size(), checksum(section.bytes)});
      out.insert(out.end(), section.bytes.begin(), section.bytes.end());
    }
    format::FileHeader header{};
    std::memcpy(header.magic, format::kMagic, sizeof header.magic);
    header.versionMajor = format::kVersionMajor;
    header.versionMinor = format::kVersionMinor;
    header.sectionCount = static_cast<std::uint32_t>(sections.size());
    header.fileSize = out.size();
    header.contentsOffset = sizeof header;
    putAt(out, 0, header);
    sealHeader(out);
    return out;
  }
};

// The first volume again as a level: the same trees, in voxels as much longer.
inline void addLevel(PackImage& image, std::uint32_t log2) {
  const format::VolumeRecord full = image.volumes[0];
  format::VolumeRecord level = full;
  level.name = {static_cast<std::uint32_t>(image.strings.size()), 8};
  image.strings += "level " + std::to_string(log2);
  level.name.size = static_cast<std::uint32_t>(image.strings.size()) - level.name.offset;
  level.firstGrid = static_cast<std::uint32_t>(image.grids.size());
  level.firstFrame = static_cast<std::uint32_t>(image.frames.size());
  level.firstGridFrame = static_cast<std::uint32_t>(image.gridFrames.size());
  const auto number = static_cast<std::uint32_t>(image.volumes.size());
  image.volumes.push_back(level);
  image.levels.push_back({0, number, log2, static_cast<std::uint32_t>(image.levelErrors.size())});
  for (std::uint32_t g = 0; g < full.gridCount; ++g) {
    image.grids.push_back(image.grids[g]);
    image.grids.back().volume = number;
  }
  for (std::uint32_t f = 0; f < full.frameCount; ++f) image.frames.push_back(image.frames[f]);
  const double factor = static_cast<double>(1u << log2);
  for (std::uint32_t i = 0; i < full.gridCount * full.frameCount; ++i) {
    format::GridFrame frame = image.gridFrames[i];
    for (int row = 0; row < 3 && (frame.flags & format::kGridPresent) != 0; ++row) {
      double* m = frame.indexToWorld + 4 * row;
      m[3] += (m[0] + m[1] + m[2]) * (factor - 1) / 2;
      for (int axis = 0; axis < 3; ++axis) m[axis] *= factor;
    }
    image.gridFrames.push_back(frame);
    image.levelErrors.push_back({0.5 * (i + 1), 0.25f, 0});
  }
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_PACK_IMAGE_H
