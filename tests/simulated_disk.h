// A disk that is as slow as it is told and fails as often: files for the streamer, read by the disk's own thread.
#ifndef BILLOW_TESTS_SIMULATED_DISK_H
#define BILLOW_TESTS_SIMULATED_DISK_H

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <random>
#include <span>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "billow/format/source.h"
#include "billow/runtime/stream.h"
#include "disk_schedule.h"

namespace billow::tests {

struct DiskFaults {
  double failures = 0;   // share of reads that end without success
  double flips = 0;      // share of reads of which one bit is wrong
  bool stalled = false;  // no read ends
};

struct DiskStats {
  std::uint64_t reads = 0, bytes = 0;  // ended, the failed ones too
  std::uint64_t failed = 0, flipped = 0;
  std::uint64_t mostPending = 0;  // reads at once
};

// Its files share its bandwidth and its queue. It outlives every read of them: destroy it after the streamer.
class SimulatedDisk {
 public:
  explicit SimulatedDisk(const DiskModel& model, std::uint32_t seed = 1)
      : schedule_(model, seed), random_(seed ^ 0x9e3779b9u), thread_([this] { run(); }) {}
  SimulatedDisk(const SimulatedDisk&) = delete;
  SimulatedDisk& operator=(const SimulatedDisk&) = delete;
  ~SimulatedDisk() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }

  // Null where the bytes are.
  std::shared_ptr<runtime::AsyncSource> file(std::unique_ptr<format::ByteSource> bytes) {
    if (bytes == nullptr) return nullptr;
    const std::lock_guard lock(mutex_);
    const std::uint64_t place = end_;
    end_ += bytes->size() + kGap;
    return std::make_shared<File>(*this, std::move(bytes), place);
  }
  std::shared_ptr<runtime::AsyncSource> file(const std::string& path) {
    auto opened = format::openFileSource(path);
    return opened ? file(std::move(*opened)) : nullptr;
  }
  std::shared_ptr<runtime::AsyncSource> file(std::vector<std::byte> bytes) {
    return file(format::makeMemorySource(std::move(bytes)));
  }

  // For reads that end from now on.
  void setFaults(const DiskFaults& faults) {
    {
      const std::lock_guard lock(mutex_);
      faults_ = faults;
    }
    changed_.notify_all();
  }

  DiskStats stats() const {
    const std::lock_guard lock(mutex_);
    return stats_;
  }

 private:
  static constexpr std::uint64_t kGap = 1 << 20;  // between files: none begins where another ends

  struct Read {
    std::shared_ptr<const format::ByteSource> bytes;
    std::uint64_t offset;
    std::span<std::byte> into;
    runtime::ReadDone done;
  };

  class File final : public runtime::AsyncSource {
   public:
    File(SimulatedDisk& disk, std::shared_ptr<const format::ByteSource> bytes, std::uint64_t place)
        : disk_(disk), bytes_(std::move(bytes)), place_(place) {}
    std::uint64_t size() const override { return bytes_->size(); }
    void read(std::uint64_t offset, std::span<std::byte> into, runtime::ReadDone done) override {
      disk_.add(place_ + offset, {bytes_, offset, into, done});
    }

   private:
    SimulatedDisk& disk_;
    std::shared_ptr<const format::ByteSource> bytes_;
    std::uint64_t place_;  // on the disk
  };

  double now() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }

  void add(std::uint64_t place, Read read) {
    {
      const std::lock_guard lock(mutex_);
      const std::uint64_t ticket = tickets_++;
      schedule_.add(std::max(now(), last_), ticket, place, read.into.size());
      reads_.emplace(ticket, std::move(read));
      stats_.mostPending = std::max<std::uint64_t>(stats_.mostPending, reads_.size());
    }
    changed_.notify_all();
  }

  void run() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
      const auto next = schedule_.next();
      if (faults_.stalled || !next) {
        changed_.wait(lock);
        continue;
      }
      last_ = now();
      for (const std::uint64_t ticket : schedule_.advance(last_)) finish(lock, ticket);
      const auto later = schedule_.next();
      if (later && *later > now()) {
        changed_.wait_until(
            lock, begin_ + std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(*later)));
      }
    }
  }

  // Without the lock while the host's function runs: it may read again, or let go of the file.
  void finish(std::unique_lock<std::mutex>& lock, std::uint64_t ticket) {
    const auto at = reads_.find(ticket);
    Read read = std::move(at->second);
    reads_.erase(at);
    const bool fails = chance(faults_.failures), flips = !fails && chance(faults_.flips) && !read.into.empty();
    const std::uint64_t which = random_();
    ++stats_.reads;
    stats_.bytes += read.into.size();
    stats_.failed += fails ? 1 : 0;
    stats_.flipped += flips ? 1 : 0;
    lock.unlock();
    const bool success = !fails && read.bytes->read(read.offset, read.into);
    if (flips) read.into[which / 8 % read.into.size()] ^= static_cast<std::byte>(1u << which % 8);
    read.bytes.reset();
    read.done.call(read.done.context, success);
    lock.lock();
  }

  bool chance(double share) { return static_cast<double>(random_() >> 8) / 16777216.0 < share; }

  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  DiskSchedule schedule_;
  std::mt19937 random_;
  DiskFaults faults_;
  DiskStats stats_;
  std::unordered_map<std::uint64_t, Read> reads_;
  std::uint64_t tickets_ = 0, end_ = 0;
  double last_ = 0;  // the schedule's time
  bool stop_ = false;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_SIMULATED_DISK_H
