#include "billow/format/validate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "grid_walk.h"
#include "guard.h"
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

// One run of the validator. After the tables the work is cut into independent parts: sections to hash, grid frames, and
// pages that no grid frame lists. A page is decompressed once for each grid frame that lists it, mostly one, and what
// is wrong with it is reported with the first.
class Validation {
 public:
  Validation(const ByteSource& source, const ValidateOptions& options)
      : source_(source),
        threads_(options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency())),
        limit_(std::max(options.maxIssues, 1u)),
        collector_(limit_) {}

  void run() {
    FileHeader header{};
    const bool sound = PackReader::read(std::make_unique<BorrowedSource>(source_), pack_, header, collector_);
    if (pack_.sections().empty()) return;
    checkPadding(source_, header, pack_.sections(), collector_);
    checkInfo();
    FirstError probe;
    checkPageTable(PackReader::view(pack_), probe);
    plan(sound, probe.errors() == 0);
    if (!collector_.stopped()) checkParts();
    // After an error, what is not reached may only be out of reach.
    if (sound && collector_.errors() == 0) usage_->check(pack_, collector_);
  }

  const std::vector<Issue>& issues() { return collector_.issues(); }

 private:
  using Issues = std::vector<Issue>;

  void checkInfo() {
    const Result<std::string> info = pack_.infoJson();
    const auto textRule = static_cast<std::uint16_t>(Rule::infoUtf8);
    if (!info && info.error().kind->id == textRule) keep({info.error()});
  }

  bool keep(Issues issues) {
    for (Issue& issue : issues) {
      collector_.report(static_cast<Rule>(issue.kind->id), issue.place, std::move(issue.detail));
    }
    return !collector_.stopped();
  }

  void plan(bool tablesSound, bool pageTableSound) {
    for (const SectionEntry& section : pack_.sections()) {
      // PackReader has hashed the tables.
      const bool table = section.type != kSectionPages && section.type != kSectionInfo;
      if (!table || sectionName(section.type).empty()) sections_.push_back(section);
    }
    if (!pageTableSound) return;
    totals_ = streamTotals(pack_.pages());
    usage_.emplace(pack_);
    owner_.assign(pack_.pages().size(), kNone);
    if (tablesSound) {
      gridFrames_ = static_cast<std::uint32_t>(pack_.gridFrames().size());
      for (std::uint32_t i = 0; i < gridFrames_; ++i) {
        const std::span<const std::uint32_t> list = pack_.pagesOf(pack_.gridFrames()[i]);
        FirstError tooLarge;  // reported in its turn; its pages are then looked at alone
        if (!checkListedBytes(pack_.pages(), list, {}, tooLarge)) continue;
        for (const std::uint32_t page : list) owner_[page] = std::min(owner_[page], i);
      }
    }
    for (std::uint32_t p = 0; p < owner_.size(); ++p) {
      if (owner_[p] == kNone) loosePages_.push_back(p);
    }
  }

  void checkParts() {
    const auto work = [&](std::size_t i) {
      Collector found(limit_);
      if (i < sections_.size()) {
        checkSectionBytes(source_, sections_[i], found);
      } else if (i - sections_.size() < gridFrames_) {
        checkGridFrame(static_cast<std::uint32_t>(i - sections_.size()), found);
      } else {
        checkLoosePage(loosePages_[i - sections_.size() - gridFrames_], found);
      }
      return std::move(found.issues());
    };
    workInOrder<Issues>(sections_.size() + gridFrames_ + loosePages_.size(), threads_, work,
                        [&](Issues issues) { return keep(std::move(issues)); });
  }

  void checkLoosePage(std::uint32_t number, IssueSink& sink) const {
    Page page;
    if (loadPage(pack_, number, page, sink)) checkPageItems(pack_, totals_, page, sink);
  }

  void checkGridFrame(std::uint32_t index, IssueSink& sink) {
    const GridFrame& frame = pack_.gridFrames()[index];
    const std::span<const std::uint32_t> list = pack_.pagesOf(frame);
    const Place place = PackReader::view(pack_).gridFramePlace(index);
    std::vector<Page> pages;
    if (!checkListedBytes(pack_.pages(), list, place, sink) || !loadPages(index, list, pages, sink)) return;
    GridWalk walk(pack_, totals_, frame, place, pages, sink);
    if (walk.check()) usage_->add(walk, pages);
  }

  // False when a page is broken.
  bool loadPages(std::uint32_t gridFrame, std::span<const std::uint32_t> numbers, std::vector<Page>& pages,
                 IssueSink& sink) const {
    struct Loaded {
      Page page;
      Issues issues;
      bool sound = false;
    };
    const auto load = [&](std::size_t i) {
      Collector all(limit_);
      FirstError none;  // the page's owner tells
      IssueSink& found = owner_[numbers[i]] == gridFrame ? static_cast<IssueSink&>(all) : none;
      Loaded loaded;
      loaded.sound =
          loadPage(pack_, numbers[i], loaded.page, found) && checkPageItems(pack_, totals_, loaded.page, found);
      loaded.issues = std::move(all.issues());
      return loaded;
    };
    bool sound = true;
    const auto use = [&](Loaded loaded) {
      for (Issue& issue : loaded.issues) {
        sink.report(static_cast<Rule>(issue.kind->id), issue.place, std::move(issue.detail));
      }
      sound = sound && loaded.sound;
      pages.push_back(std::move(loaded.page));
      return !sink.stopped();
    };
    pages.reserve(numbers.size());
    // Threads that whole grid frames leave idle.
    const unsigned threads = threads_ / std::max(1u, std::min(threads_, gridFrames_));
    workInOrder<Loaded>(numbers.size(), threads, load, use);
    return sound && !sink.stopped();
  }

  const ByteSource& source_;
  const unsigned threads_;
  const std::size_t limit_;
  Collector collector_;
  Pack pack_;
  StreamTotals totals_;
  std::vector<SectionEntry> sections_;
  std::uint32_t gridFrames_ = 0;
  std::vector<std::uint32_t> loosePages_;
  std::vector<std::uint32_t> owner_;  // by page: the first grid frame that lists it
  std::optional<Usage> usage_;
};

}  // namespace

void validate(const ByteSource& source, const ValidateOptions& options, const std::function<void(const Issue&)>& sink) {
  Validation validation(source, options);
  const Result<bool> finished = guarded<bool>([&] {
    validation.run();
    return true;
  });
  for (const Issue& issue : validation.issues()) sink(issue);
  if (!finished) sink(finished.error());
}

}  // namespace billow::format
