#include "stream/page_reads.h"

#include <algorithm>

namespace billow::runtime {
namespace {

constexpr std::uint64_t kMostGap = 4096;                      // bytes that are read in vain to save a read
constexpr std::uint64_t kMostRun = std::uint64_t{512} << 10;  // so that large loads are read by several threads
constexpr std::size_t kAlign = 64;

}  // namespace

// Where pages lie in the file, and which of them are read in one go.
struct PageReads::Layout {
  std::uint64_t bytes = 0;
  std::uint32_t runs = 0;

  // Calls run(offset, bytes, firstPlace, count, at) for each, `at` being where its bytes begin in memory.
  template <class Use>
  Layout(std::span<const Place> places, const Use& use) {
    for (std::uint32_t first = 0; first < places.size();) {
      std::uint64_t end = places[first].offset + places[first].bytes;
      std::uint32_t next = first + 1;
      for (; next < places.size(); ++next) {
        const Place& place = places[next];
        if (place.offset < end || place.offset - end > kMostGap) break;
        if (place.offset + place.bytes - places[first].offset > kMostRun) break;
        end = place.offset + place.bytes;
      }
      const std::uint64_t size = end - places[first].offset;
      use(places[first].offset, size, first, next - first, bytes);
      bytes += (size + kAlign - 1) / kAlign * kAlign;
      ++runs;
      first = next;
    }
  }

  template <class Places>
  static void fill(const format::Pack& pack, std::span<const std::uint32_t> numbers, Places& places) {
    places.reserve(numbers.size());
    for (const std::uint32_t number : numbers) {
      // Without a place the read fails.
      const std::uint64_t offset = format::placeOfPage(pack, number).offset.value_or(~std::uint64_t{0} >> 1);
      places.push_back({.offset = offset,
                        .number = number,
                        .bytes = pack.pages()[number].storedSize,
                        .page = static_cast<std::uint32_t>(places.size())});
    }
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.offset < b.offset; });
  }
};

PageReads::PageReads(std::pmr::memory_resource* memory, ReadsInFlight& inFlight)
    : memory_(memory), inFlight_(inFlight), places_(memory), runs_(memory), pages_(memory) {}

std::uint64_t PageReads::bytesFor(const format::Pack& pack, std::span<const std::uint32_t> numbers) {
  std::vector<Place> places;
  Layout::fill(pack, numbers, places);
  const Layout layout(places, [](auto...) {});
  return layout.bytes + numbers.size() * (sizeof(Place) + sizeof(Run) + sizeof(StoredPage)) + layout.runs * sizeof(Run);
}

void PageReads::clear() {
  if (bytes_ != nullptr) memory_->deallocate(bytes_, size_, kAlign);
  bytes_ = nullptr;
  places_ = std::pmr::vector<Place>(memory_);
  runs_ = std::pmr::vector<Run>(memory_);
  pages_ = std::pmr::vector<StoredPage>(memory_);
}

std::optional<std::uint32_t> PageReads::failed() const {
  return failed_ != format::kNone ? std::optional(failed_.load()) : std::nullopt;
}

void PageReads::start(Jobs& jobs, const OpenPack& pack, std::span<const std::uint32_t> numbers, const Job& done) {
  jobs_ = &jobs;
  pack_ = &pack;
  done_ = done;
  sourceSize_ = pack.source != nullptr ? pack.source->size() : pack.pack.source().size();
  Layout::fill(pack.pack, numbers, places_);
  const Layout layout(places_, [](auto...) {});
  pages_.resize(numbers.size());
  runs_.resize(layout.runs + numbers.size());
  bytes_ = static_cast<std::byte*>(memory_->allocate(std::max<std::size_t>(layout.bytes, 1), kAlign));
  size_ = std::max<std::size_t>(layout.bytes, 1);
  std::uint32_t run = 0;
  (void)Layout(places_, [&](std::uint64_t offset, std::uint64_t bytes, std::uint32_t first, std::uint32_t count,
                            std::uint64_t at) {
    runs_[run++] = {this, offset, {bytes_ + at, bytes}, first, count};
    for (std::uint32_t i = first; i < first + count; ++i) {
      const Place& place = places_[i];
      pages_[place.page] = {place.number, {bytes_ + at + (place.offset - offset), place.bytes}};
    }
  });
  // One more than the runs: `done` comes after the loop, whoever is the last.
  const std::uint32_t runs = layout.runs;
  pending_ = runs + 1;
  for (std::uint32_t i = 0; i < runs; ++i) issue(runs_[i]);
  if (--pending_ == 0) done.call(done.context);
}

void PageReads::issue(Run& run) {
  if (abandoned_) return finish(run, false);
  if (run.offset > sourceSize_ || run.into.size() > sourceSize_ - run.offset) return finish(run, false);
  if (pack_->source != nullptr) {
    inFlight_.add();
    return pack_->source->read(run.offset, run.into, {&onDone, &run});
  }
  try {
    jobs_->read({&readNow, &run});
  } catch (const std::bad_alloc&) {
    finish(run, false);
  }
}

void PageReads::readNow(void* context) {
  Run& run = *static_cast<Run*>(context);
  PageReads& reads = *run.reads;
  reads.finish(run, !reads.abandoned_ && reads.pack_->pack.source().read(run.offset, run.into));
}

void PageReads::onDone(void* context, bool success) {
  Run& run = *static_cast<Run*>(context);
  ReadsInFlight& inFlight = run.reads->inFlight_;  // the run may be gone after its end
  run.reads->finish(run, success);
  inFlight.remove();
}

void PageReads::finish(Run& run, bool success) {
  if (success) {
    bytesRead_ += run.into.size();
  } else if (run.count > 1 && !abandoned_) {
    split(run);
  } else if (!abandoned_) {
    std::uint32_t none = format::kNone;
    failed_.compare_exchange_strong(none, places_[run.firstPlace].number);
    abandoned_ = true;  // the rest is of no use
  }
  if (--pending_ != 0) return;
  const Job done = done_;
  done.call(done.context);
}

// Reads the pages of a run one by one: which of them is it?
void PageReads::split(const Run& run) {
  pending_ += run.count;
  for (std::uint32_t i = run.firstPlace; i < run.firstPlace + run.count; ++i) {
    Run& single = runs_[runs_.size() - places_.size() + i];
    const StoredPage& page = pages_[places_[i].page];
    single = {this, places_[i].offset, {bytes_ + (page.bytes.data() - bytes_), page.bytes.size()}, i, 1};
    issue(single);
  }
}

}  // namespace billow::runtime
