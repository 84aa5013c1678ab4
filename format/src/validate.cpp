#include "billow/format/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "grid_walk.h"
#include "parallel.h"
#include "rules.h"

namespace billow::format {
namespace {

class BorrowedSource : public ByteSource {
 public:
  explicit BorrowedSource(const ByteSource& source) : source_(source) {}
  std::uint64_t size() const override { return source_.size(); }
  bool read(std::uint64_t offset, std::span<std::byte> into) const override { return source_.read(offset, into); }

 private:
  const ByteSource& source_;
};

// What the grid frames reach, over all of them.
class Usage {
 public:
  explicit Usage(const Pack& pack) : pages_(pack.pages().size()) {}

  void add(GridWalk& walk, std::span<const Page> pages) {
    const std::lock_guard lock(mutex_);
    for (std::uint32_t s = 0; s < kTracked; ++s) {
      const std::span<const std::uint8_t> reached = walk.reached(static_cast<Stream>(s));
      for (const ItemFinder::Run& run : walk.finder().runs(static_cast<Stream>(s))) {
        std::vector<bool>& bits = pages_[pages[run.page].number].reached[s];
        bits.resize(run.count);
        for (std::uint32_t i = 0; i < run.count; ++i) {
          if (reached[run.local + i] != 0) bits[i] = true;
        }
      }
    }
    for (const Page& page : pages) pages_[page.number].listed = true;
  }

  void check(const Pack& pack, IssueSink& sink) const {
    for (std::uint32_t p = 0; p < pages_.size() && !sink.stopped(); ++p) {
      Place place = PackReader::view(pack).place(kSectionPages, pack.pages()[p].offset);
      place.page = p;
      if (!pages_[p].listed) {
        sink.report(Rule::pageUnused, place, "No grid frame lists it.");
        continue;
      }
      for (std::uint32_t s = 0; s < kTracked; ++s) checkStream(pack, p, s, place, sink);
    }
  }

 private:
  // Not the child lists: what they hold is reached or it isn't.
  static constexpr std::uint32_t kTracked = static_cast<std::uint32_t>(Stream::child);
  struct PageUsage {
    bool listed = false;
    std::array<std::vector<bool>, kTracked> reached;
  };

  void checkStream(const Pack& pack, std::uint32_t page, std::uint32_t stream, Place place, IssueSink& sink) const {
    static constexpr std::string_view kNames[kTracked] = {"brick units", "masks", "Node5", "Node4", "Node3"};
    const StreamRange& run = pack.pages()[page].streams[stream];
    const std::vector<bool>& bits = pages_[page].reached[stream];
    const auto unused = run.count - static_cast<std::uint32_t>(std::count(bits.begin(), bits.end(), true));
    if (unused == 0) return;
    const auto first = static_cast<std::uint64_t>(std::find(bits.begin(), bits.end(), false) - bits.begin());
    place.nodeKind = kNames[stream];
    place.node = run.first + first;
    sink.report(Rule::itemUnused, place,
                fmt::format("{} of its {} {} are not reached.", unused, run.count, kNames[stream]));
  }

  std::mutex mutex_;
  std::vector<PageUsage> pages_;
};

// One run of the validator.
class Validation {
 public:
  Validation(const ByteSource& source, const ValidateOptions& options)
      : source_(source),
        threads_(options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency())),
        limit_(std::max(options.maxIssues, 1u)),
        collector_(limit_) {}

  std::vector<Issue>& run() {
    FileHeader header{};
    const bool sound = PackReader::read(std::make_unique<BorrowedSource>(source_), pack_, header, collector_);
    if (pack_.sections().empty()) return collector_.issues();
    checkPadding(source_, header, pack_.sections(), collector_);
    checkSections();
    FirstError probe;
    checkPageTable(PackReader::view(pack_), probe);
    if (probe.errors() == 0 && !collector_.stopped()) checkPages();
    if (sound && !collector_.stopped()) checkGridFrames();
    return collector_.issues();
  }

 private:
  using Issues = std::vector<Issue>;

  bool keep(Issues issues) {
    for (Issue& issue : issues) {
      collector_.report(static_cast<Rule>(issue.kind->id), issue.place, std::move(issue.detail));
    }
    return !collector_.stopped();
  }

  // Those that PackReader has not hashed.
  void checkSections() {
    std::vector<SectionEntry> rest;
    for (const SectionEntry& section : pack_.sections()) {
      const bool table = section.type != kSectionPages && section.type != kSectionInfo;
      if (!table || sectionName(section.type).empty()) rest.push_back(section);
    }
    const auto work = [&](std::size_t i) {
      Collector found(limit_);
      checkSectionBytes(source_, rest[i], found);
      return std::move(found.issues());
    };
    OrderedWork<Issues>(rest.size(), threads_, work, [&](Issues issues) { return keep(std::move(issues)); });
    const Result<std::string> info = pack_.infoJson();
    if (!info && info.error().kind->id == static_cast<std::uint16_t>(Rule::infoUtf8)) keep({info.error()});
  }

  void checkPages() {
    totals_ = streamTotals(pack_.pages());
    sound_.assign(pack_.pages().size(), 0);
    const auto work = [&](std::size_t i) {
      Collector found(limit_);
      Page page;
      const auto number = static_cast<std::uint32_t>(i);
      if (loadPage(pack_, number, page, found)) sound_[i] = checkPageItems(pack_, totals_, page, found) ? 1 : 0;
      return std::move(found.issues());
    };
    OrderedWork<Issues>(pack_.pages().size(), threads_, work, [&](Issues issues) { return keep(std::move(issues)); });
  }

  void checkGridFrames() {
    Usage usage(pack_);
    const auto work = [&](std::size_t i) {
      Collector found(limit_);
      checkGridFrame(i, usage, found);
      return std::move(found.issues());
    };
    OrderedWork<Issues>(pack_.gridFrames().size(), threads_, work,
                        [&](Issues issues) { return keep(std::move(issues)); });
    // After an error, what is not reached may only be out of reach.
    if (collector_.errors() == 0) usage.check(pack_, collector_);
  }

  void checkGridFrame(std::size_t index, Usage& usage, IssueSink& sink) {
    const GridFrame& frame = pack_.gridFrames()[index];
    std::vector<Page> pages;
    for (const std::uint32_t number : pack_.pagesOf(frame)) {
      // Its own issues are known by now.
      if (sound_[number] == 0) return;
      Page page;
      if (!loadPage(pack_, number, page, sink)) return;
      pages.push_back(std::move(page));
    }
    GridWalk walk(pack_, totals_, frame, PackReader::view(pack_).gridFramePlace(index), pages, sink);
    if (walk.check()) usage.add(walk, pages);
  }

  const ByteSource& source_;
  const unsigned threads_;
  const std::size_t limit_;
  Collector collector_;
  Pack pack_;
  StreamTotals totals_;
  std::vector<std::uint8_t> sound_;  // by page; a byte each, since threads write neighbours
};

}  // namespace

void validate(const ByteSource& source, const ValidateOptions& options, const std::function<void(const Issue&)>& sink) {
  Validation validation(source, options);
  for (const Issue& issue : validation.run()) sink(issue);
}

}  // namespace billow::format
