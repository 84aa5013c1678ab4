// Items by their global indices, in the pages of one frame.
#ifndef BILLOW_RUNTIME_STREAM_PAGE_ITEMS_H
#define BILLOW_RUNTIME_STREAM_PAGE_ITEMS_H

#include <algorithm>
#include <array>
#include <span>

#include "billow/format/layout.h"

namespace billow::runtime {

class PageItems {
 public:
  struct Run {
    std::uint32_t first;
    std::uint32_t count;
    std::uint32_t local;  // number of the first item among all of these pages
    std::uint32_t page;
    const std::byte* data;
  };
  struct Found {
    const std::byte* data = nullptr;  // null: not in these pages
    std::uint32_t local = 0;
    std::uint32_t page = 0;
  };

  // Runs of a stream, without empty ones; `room` has as many as there are pages.
  void giveRoom(std::uint32_t stream, std::span<Run> room) { streams_[stream] = {room.data(), 0, 0, 0}; }
  // Pages come in ascending order.
  void add(const format::PageRecord& record, std::uint32_t page, const std::byte* content) {
    for (std::uint32_t s = 0; s < format::kStreamCount; ++s) {
      const format::StreamRange& range = record.streams[s];
      Of& stream = streams_[s];
      if (range.count != 0) stream.runs[stream.size++] = {range.first, range.count, stream.items, page, content};
      stream.items += range.count;
      content += std::size_t{range.count} * format::kStreamItemBytes[s];
    }
  }

  // `count` items, at least one, that follow one another in one page.
  Found find(format::Stream which, std::uint32_t first, std::uint32_t count) {
    const auto s = static_cast<std::uint32_t>(which);
    Of& stream = streams_[s];
    if (stream.last < stream.size && holds(stream.runs[stream.last], first, count)) {
      return found(stream.runs[stream.last], s, first);
    }
    const Run* const begin = stream.runs;
    const Run* const end = begin + stream.size;
    const Run* run = std::upper_bound(begin, end, first, [](std::uint32_t at, const Run& r) { return at < r.first; });
    if (run == begin || !holds(*--run, first, count)) return {};
    stream.last = static_cast<std::uint32_t>(run - begin);
    return found(*run, s, first);
  }

 private:
  struct Of {
    Run* runs = nullptr;
    std::uint32_t size = 0;
    std::uint32_t items = 0;
    std::uint32_t last = 0;  // neighbours mostly lie in the same run
  };

  static bool holds(const Run& run, std::uint32_t first, std::uint32_t count) {
    const std::uint32_t before = first - run.first;
    return first >= run.first && before < run.count && count <= run.count - before;
  }
  static Found found(const Run& run, std::uint32_t stream, std::uint32_t first) {
    const std::uint32_t before = first - run.first;
    return {run.data + std::size_t{before} * format::kStreamItemBytes[stream], run.local + before, run.page};
  }

  std::array<Of, format::kStreamCount> streams_;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_PAGE_ITEMS_H
