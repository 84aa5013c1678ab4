// The stored pages of one load: read on billow's threads or by the host, several at once, neighbours in one go.
#ifndef BILLOW_RUNTIME_STREAM_PAGE_READS_H
#define BILLOW_RUNTIME_STREAM_PAGE_READS_H

#include <atomic>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "stream/jobs.h"
#include "stream/load_frame.h"
#include "stream/transport.h"

namespace billow::runtime {

// Reads of hosts that have not ended.
class ReadsInFlight {
 public:
  void add() {
    const std::lock_guard lock(mutex_);
    ++count_;
  }
  void remove() {
    const std::lock_guard lock(mutex_);
    --count_;
    none_.notify_all();
  }
  void waitForNone() {
    std::unique_lock lock(mutex_);
    none_.wait(lock, [&] { return count_ == 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable none_;
  std::uint64_t count_ = 0;
};

// Neither moved nor destroyed between start() and the call of `done`.
class PageReads {
 public:
  PageReads(std::pmr::memory_resource* memory, ReadsInFlight& inFlight);
  PageReads(const PageReads&) = delete;
  PageReads& operator=(const PageReads&) = delete;
  ~PageReads() { clear(); }

  // Bytes of memory that start() takes for these pages of the pack.
  static std::uint64_t bytesFor(const format::Pack& pack, std::span<const std::uint32_t> numbers);

  // Begins to read pages, by ascending number. `done` is called once, from any thread, even from inside of start().
  // Throws std::bad_alloc, and then reads nothing and calls nothing.
  void start(Jobs& jobs, const OpenPack& pack, std::span<const std::uint32_t> numbers, const Job& done);
  // Reads that were not begun are left out; `done` is called all the same. From any thread.
  void abandon() { abandoned_ = true; }

  // After `done`: the pages, until clear().
  std::span<const StoredPage> pages() const { return pages_; }
  // The first page that could not be read.
  std::optional<std::uint32_t> failed() const;
  std::uint64_t bytesRead() const { return bytesRead_; }
  void clear();

 private:
  // Pages that lie beside each other in the file.
  struct Run {
    PageReads* reads = nullptr;
    std::uint64_t offset = 0;
    std::span<std::byte> into;
    std::uint32_t firstPlace = 0, count = 0;  // in places_
  };
  struct Place {
    std::uint64_t offset = 0;
    std::uint32_t number = 0, bytes = 0;
    std::uint32_t page = 0;  // in pages_
  };
  struct Layout;

  void issue(Run& run);
  static void readNow(void* run);
  static void onDone(void* run, bool success);
  void finish(Run& run, bool success);
  void split(const Run& run);

  std::pmr::memory_resource* memory_;
  ReadsInFlight& inFlight_;
  std::byte* bytes_ = nullptr;
  std::size_t size_ = 0;
  std::pmr::vector<Place> places_;  // by offset
  std::pmr::vector<Run> runs_;      // those of start(), then one a place for those that failed
  std::pmr::vector<StoredPage> pages_;
  Jobs* jobs_ = nullptr;
  const OpenPack* pack_ = nullptr;
  std::uint64_t sourceSize_ = 0;
  Job done_;
  std::atomic<std::uint32_t> pending_ = 0;
  std::atomic<bool> abandoned_ = false;
  std::atomic<std::uint32_t> failed_ = format::kNone;
  std::atomic<std::uint64_t> bytesRead_ = 0;
};

}  // namespace billow::runtime

#endif  // BILLOW_RUNTIME_STREAM_PAGE_READS_H
