#include <fmt/format.h>

#include "rules.h"

namespace billow::format {
namespace {

void checkPageRecord(const PageRecord& page, const Place& place, IssueSink& sink) {
  std::uint64_t bytes = 0;
  for (std::uint32_t i = 0; i < kStreamCount; ++i) {
    bytes += std::uint64_t{page.streams[i].count} * kStreamItemBytes[i];
  }
  const bool raw = page.codec == static_cast<std::uint32_t>(Codec::raw);
  if (page.codec > static_cast<std::uint32_t>(Codec::model)) {
    sink.report(Rule::pageCodec, place, fmt::format("Codec {}.", page.codec));
  }
  const bool stored = raw ? page.storedSize == page.rawSize : page.storedSize > 0 && page.storedSize < page.rawSize;
  if (page.rawSize == 0 || page.rawSize > kMaxPageBytes || page.rawSize != bytes || !stored) {
    sink.report(Rule::pageSize, place,
                fmt::format("{} bytes stored, {} raw, {} in its runs.", page.storedSize, page.rawSize, bytes));
  }
}

}  // namespace

StreamTotals streamTotals(std::span<const PageRecord> pages) {
  StreamTotals totals;
  for (const PageRecord& page : pages) {
    for (std::uint32_t i = 0; i < kStreamCount; ++i) totals.count[i] += page.streams[i].count;
  }
  return totals;
}

void checkPageTable(const TableView& tables, IssueSink& sink) {
  std::uint64_t offset = 0;
  StreamTotals totals;
  for (std::size_t i = 0; i < tables.pages.size() && !sink.stopped(); ++i) {
    const PageRecord& page = tables.pages[i];
    Place place = tables.place(kSectionPageTable, i * sizeof(PageRecord));
    place.page = static_cast<std::uint32_t>(i);
    checkPageRecord(page, place, sink);
    if (page.offset != offset) {
      sink.report(Rule::pageOffset, place,
                  fmt::format("It lies at {}, the page before ends at {}.", page.offset, offset));
    }
    offset = page.offset + page.storedSize;
    for (std::uint32_t s = 0; s < kStreamCount; ++s) {
      if (page.streams[s].first != totals.count[s]) {
        sink.report(Rule::pageStreams, place,
                    fmt::format("Run {} begins at {}, expected {}.", s, page.streams[s].first, totals.count[s]));
      }
      totals.count[s] += page.streams[s].count;
    }
  }
  for (std::uint32_t s = 0; s < kStreamCount; ++s) {
    if (totals.count[s] > kStreamLimit[s]) {
      sink.report(Rule::streamLength, tables.place(kSectionPageTable, 0),
                  fmt::format("Array {} has {} items.", s, totals.count[s]));
    }
  }
  for (const SectionEntry& entry : tables.sections) {
    if (entry.type != kSectionPages || entry.size == offset) continue;
    sink.report(Rule::pageOffset, tables.place(kSectionPages, 0),
                fmt::format("The pages have {} bytes, their section {}.", offset, entry.size));
  }
}

}  // namespace billow::format
