#include "rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>

#include "hash.h"

namespace billow::format {
namespace {

constexpr std::uint64_t kMostPadding = 4096;
constexpr std::size_t kPiece = std::size_t{256} << 10;  // stays in a cache between reading and hashing

struct SectionKind {
  std::string_view name;
  std::uint32_t type;
  std::uint32_t flags;
};
constexpr SectionKind kSectionKinds[] = {
    {"PAGE", kSectionPages, kSectionRequired},
    {"STRS", kSectionStrings, kSectionRequired},
    {"VOLS", kSectionVolumes, kSectionRequired},
    {"GRDS", kSectionGrids, kSectionRequired},
    {"FRMS", kSectionFrames, kSectionRequired},
    {"GFRM", kSectionGridFrames, kSectionRequired},
    {"PLST", kSectionPageLists, kSectionRequired},
    {"PDIR", kSectionPageTable, kSectionRequired},
    {"INFO", kSectionInfo, 0},
    {"LEVL", kSectionLevels, 0},
    {"LERR", kSectionLevelErrors, 0},
    {"EFCT", kSectionEffects, 0},
    {"EMIT", kSectionEmitters, 0},
    {"SPWN", kSectionSpans, 0},
    {"MTRL", kSectionMaterials, 0},
    {"CURV", kSectionCurves, 0},
    {"RAMP", kSectionRamps, 0},
    {"CUBE", kSectionCubes, 0},
    {"GIVN", kSectionGiven, 0},
    {"TRCK", kSectionTracks, 0},
    {"TRFR", kSectionTrackFrames, 0},
    {"TRPT", kSectionTrackBytes, 0},
    {"SURF", kSectionSurfaces, 0},
};

const SectionKind* kindOfSection(std::uint32_t type) {
  const auto* found = std::find_if(std::begin(kSectionKinds), std::end(kSectionKinds),
                                   [&](const SectionKind& kind) { return kind.type == type; });
  return found == std::end(kSectionKinds) ? nullptr : found;
}

Place headerPlace(std::uint64_t offset) {
  Place place;
  place.section = "header";
  place.offset = offset;
  return place;
}

Place contentsPlace(std::size_t entry) {
  Place place;
  place.section = "contents";
  place.offset = sizeof(FileHeader) + entry * sizeof(SectionEntry);
  return place;
}

void reportUnreadable(std::uint64_t offset, std::uint64_t bytes, IssueSink& sink) {
  Place place;
  place.offset = offset;
  sink.report(Rule::cannotRead, place, fmt::format("{} bytes cannot be read.", bytes));
}

// False where the file is too short to be a pack, or is something else.
bool checkMagic(const ByteSource& source, IssueSink& sink) {
  std::array<std::uint8_t, sizeof(kMagic)> magic{};
  const std::size_t length = std::min<std::uint64_t>(source.size(), magic.size());
  if (!source.read(0, std::as_writable_bytes(std::span(magic).first(length)))) {
    reportUnreadable(0, length, sink);
    return false;
  }
  if (!std::equal(magic.begin(), magic.begin() + static_cast<std::ptrdiff_t>(length), std::begin(kMagic))) {
    sink.report(Rule::magic, headerPlace(0), "This is not a billow pack.");
    return false;
  }
  if (source.size() < sizeof(FileHeader)) {
    sink.report(Rule::tooShort, headerPlace(0),
                fmt::format("The file has {} bytes; the header alone needs {}.", source.size(), sizeof(FileHeader)));
    return false;
  }
  return true;
}

// Whether the entry's bytes may be read and hashed by it.
bool checkEntryRange(const SectionEntry& entry, std::uint64_t previousEnd, std::uint64_t fileSize, const Place& place,
                     IssueSink& sink) {
  bool usable = true;
  if (entry.offset % kSectionAlignment != 0) {
    sink.report(Rule::sectionAlignment, place, fmt::format("Offset {} is no multiple of 64.", entry.offset));
  }
  if (entry.offset > fileSize || entry.size > fileSize - entry.offset) {
    sink.report(Rule::sectionRange, place,
                fmt::format("{} bytes at {} exceed the file's {}.", entry.size, entry.offset, fileSize));
    usable = false;
  }
  if (entry.offset < previousEnd) {
    sink.report(Rule::sectionOrder, place,
                fmt::format("It begins at {}, before {} where the bytes before it end.", entry.offset, previousEnd));
    usable = false;
  } else if (entry.offset - previousEnd >= kMostPadding) {
    sink.report(Rule::paddingLength, place, fmt::format("{} bytes before it are unused.", entry.offset - previousEnd));
  }
  return usable;
}

// Whether the entry's type and flags let a reader use it.
bool checkEntryKind(const SectionEntry& entry, std::span<const SectionEntry> before, const Place& place,
                    IssueSink& sink) {
  if ((entry.flags & ~kSectionRequired) != 0) {
    sink.report(Rule::sectionFlags, place, fmt::format("Flags {:#x} have reserved bits.", entry.flags));
  }
  const SectionKind* kind = kindOfSection(entry.type);
  if (kind == nullptr) {
    if ((entry.flags & kSectionRequired) == 0) return true;
    sink.report(Rule::sectionUnknown, place,
                fmt::format("Type {:#010x} is unknown, yet required for reading.", entry.type));
    return false;
  }
  if ((entry.flags & kSectionRequired) != kind->flags) {
    sink.report(Rule::sectionFlags, place,
                fmt::format("{} must {}be marked as required.", kind->name, kind->flags == 0 ? "not " : ""));
  }
  const bool repeated =
      std::any_of(before.begin(), before.end(), [&](const SectionEntry& other) { return other.type == entry.type; });
  if (repeated) sink.report(Rule::sectionDuplicate, place, fmt::format("{} is listed twice.", kind->name));
  return !repeated;
}

void checkZero(const ByteSource& source, std::uint64_t begin, std::uint64_t end, IssueSink& sink) {
  std::vector<std::byte> piece;
  while (begin < end && !sink.stopped()) {
    piece.resize(std::min<std::uint64_t>(end - begin, kPiece));
    if (!source.read(begin, piece)) return reportUnreadable(begin, piece.size(), sink);
    const auto bad = std::find_if(piece.begin(), piece.end(), [](std::byte byte) { return byte != std::byte{0}; });
    if (bad != piece.end()) {
      Place place;
      place.offset = begin + static_cast<std::uint64_t>(bad - piece.begin());
      return sink.report(Rule::padding, place, fmt::format("It is {:#04x}.", std::to_integer<unsigned>(*bad)));
    }
    begin += piece.size();
  }
}

// Length of the well-formed UTF-8 sequence that `text` begins with, 0 where it does not (Unicode 15, table 3-7).
std::size_t sequenceLength(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const auto within = [&](std::size_t i, unsigned low, unsigned high) { return byte(i) >= low && byte(i) <= high; };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  if (lead >= 0xc2 && lead <= 0xdf) return within(1, 0x80, 0xbf) ? 2 : 0;
  if (lead >= 0xe0 && lead <= 0xef) {
    const bool second = within(1, lead == 0xe0 ? 0xa0 : 0x80, lead == 0xed ? 0x9f : 0xbf);
    return second && within(2, 0x80, 0xbf) ? 3 : 0;
  }
  if (lead >= 0xf0 && lead <= 0xf4) {
    const bool second = within(1, lead == 0xf0 ? 0x90 : 0x80, lead == 0xf4 ? 0x8f : 0xbf);
    return second && within(2, 0x80, 0xbf) && within(3, 0x80, 0xbf) ? 4 : 0;
  }
  return 0;
}

}  // namespace

std::string_view sectionName(std::uint32_t type) {
  const SectionKind* kind = kindOfSection(type);
  return kind == nullptr ? std::string_view{} : kind->name;
}

bool isUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = sequenceLength(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

bool checkHeader(const ByteSource& source, FileHeader& header, IssueSink& sink) {
  if (!checkMagic(source, sink)) return false;
  const std::span<std::byte> bytes = std::as_writable_bytes(std::span(&header, 1));
  if (!source.read(0, bytes)) {
    reportUnreadable(0, bytes.size(), sink);
    return false;
  }
  if (header.versionMajor != kVersionMajor) {
    sink.report(Rule::majorVersion, headerPlace(8),
                fmt::format("The pack is of version {}.{}; this reader knows {}.x.", header.versionMajor,
                            header.versionMinor, kVersionMajor));
    return false;
  }
  if (hashBytes(bytes.first(offsetof(FileHeader, headerChecksum))) != header.headerChecksum) {
    sink.report(Rule::headerChecksum, headerPlace(offsetof(FileHeader, headerChecksum)), "The header was altered.");
  }
  if (header.versionMinor > kVersionMinor) {
    sink.report(Rule::minorVersion, headerPlace(10),
                fmt::format("The pack is of version {}.{}; what {}.{} does not know is passed over.",
                            header.versionMajor, header.versionMinor, kVersionMajor, kVersionMinor));
  }
  if (header.reserved[0] != 0 || header.reserved[1] != 0) {
    sink.report(Rule::headerReserved, headerPlace(offsetof(FileHeader, reserved)), "They are not.");
  }
  if (header.fileSize != source.size()) {
    sink.report(Rule::fileSize, headerPlace(offsetof(FileHeader, fileSize)),
                fmt::format("The header says {} bytes, the file has {}.", header.fileSize, source.size()));
  }
  return !sink.stopped();
}

bool readContents(const ByteSource& source, const FileHeader& header, std::vector<SectionEntry>& sections,
                  IssueSink& sink) {
  const std::uint64_t bytes = std::uint64_t{header.sectionCount} * sizeof(SectionEntry);
  if (header.contentsOffset != sizeof(FileHeader) || header.sectionCount > kMaxSections ||
      bytes > source.size() - sizeof(FileHeader)) {
    sink.report(Rule::contentsRange, headerPlace(offsetof(FileHeader, sectionCount)),
                fmt::format("{} sections are listed at {}.", header.sectionCount, header.contentsOffset));
    return false;
  }
  sections.resize(header.sectionCount);
  const std::span<std::byte> into = std::as_writable_bytes(std::span(sections));
  if (!source.read(sizeof(FileHeader), into)) {
    reportUnreadable(sizeof(FileHeader), bytes, sink);
    return false;
  }
  if (hashBytes(into) != header.contentsChecksum) {
    sink.report(Rule::contentsChecksum, contentsPlace(0), "The contents were altered.");
  }
  return !sink.stopped();
}

void checkContents(const ByteSource& source, std::vector<SectionEntry>& sections, IssueSink& sink) {
  std::vector<SectionEntry> usable;
  std::uint64_t end = sizeof(FileHeader) + sections.size() * sizeof(SectionEntry);
  for (std::size_t i = 0; i < sections.size() && !sink.stopped(); ++i) {
    const SectionEntry& entry = sections[i];
    Place place = contentsPlace(i);
    if (!sectionName(entry.type).empty()) place.section = sectionName(entry.type);
    const bool inRange = checkEntryRange(entry, end, source.size(), place, sink);
    if (inRange) end = entry.offset + entry.size;
    if (checkEntryKind(entry, usable, place, sink) && inRange) usable.push_back(entry);
  }
  for (const SectionKind& kind : kSectionKinds) {
    const bool listed = std::any_of(sections.begin(), sections.end(),
                                    [&](const SectionEntry& entry) { return entry.type == kind.type; });
    if (kind.flags == kSectionRequired && !listed) {
      sink.report(Rule::sectionMissing, contentsPlace(0), fmt::format("{} is missing.", kind.name));
    }
  }
  if (end != source.size()) {
    sink.report(Rule::fileEnd, contentsPlace(0),
                fmt::format("The last section ends at {}, the file at {}.", end, source.size()));
  }
  sections = std::move(usable);
}

void checkPadding(const ByteSource& source, const FileHeader& header, std::span<const SectionEntry> sections,
                  IssueSink& sink) {
  std::uint64_t end = sizeof(FileHeader) + std::uint64_t{header.sectionCount} * sizeof(SectionEntry);
  for (const SectionEntry& entry : sections) {
    if (entry.offset > end) checkZero(source, end, entry.offset, sink);
    end = entry.offset + entry.size;
  }
}

void checkSectionBytes(const ByteSource& source, const SectionEntry& section, IssueSink& sink) {
  Hasher hasher;
  std::vector<std::byte> piece;
  for (std::uint64_t done = 0; done < section.size; done += piece.size()) {
    piece.resize(std::min<std::uint64_t>(section.size - done, kPiece));
    if (!source.read(section.offset + done, piece)) return reportUnreadable(section.offset + done, piece.size(), sink);
    hasher.add(piece);
  }
  if (hasher.digest() == section.checksum) return;
  Place place;
  place.section = sectionName(section.type).empty() ? std::string_view("section") : sectionName(section.type);
  place.offset = section.offset;
  sink.report(Rule::sectionChecksum, place, fmt::format("Its {} bytes were altered.", section.size));
}

}  // namespace billow::format
