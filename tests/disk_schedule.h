// When the reads of a disk end: its latency, queue, bandwidth and luck, in a time that whoever asks keeps.
#ifndef BILLOW_TESTS_DISK_SCHEDULE_H
#define BILLOW_TESTS_DISK_SCHEDULE_H

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <vector>

namespace billow::tests {

struct DiskModel {
  const char* name = "memory";
  double bytesPerSecond = 0;     // of all reads together; 0: no limit
  double latency = 0;            // seconds from a read's turn to its first byte
  double jitter = 0;             // mean of what a read waits on top, seconds, distributed exponentially
  std::uint32_t queueDepth = 1;  // reads whose latencies overlap; further ones wait for their turn
  bool seeks = false;            // a read that begins where the last one ended has no latency
};

inline constexpr DiskModel kMemoryDisk{"memory", 0, 0, 0, 64, false};
inline constexpr DiskModel kNvme{"NVMe", 3e9, 80e-6, 10e-6, 64, false};
inline constexpr DiskModel kSataSsd{"SATA SSD", 500e6, 150e-6, 30e-6, 32, false};
inline constexpr DiskModel kHardDisk{"HDD", 120e6, 9e-3, 1e-3, 1, true};
inline constexpr DiskModel kNetwork{"network", 12e6, 30e-3, 10e-3, 16, false};

// Reads get one of queueDepth places in the order in which they came, wait there for their latency, and then share one
// pipe in the order in which they were ready.
class DiskSchedule {
 public:
  DiskSchedule(const DiskModel& model, std::uint32_t seed) : model_(model), random_(seed) {}

  // `now` never decreases from call to call, of advance() neither.
  void add(double now, std::uint64_t ticket, std::uint64_t offset, std::uint64_t bytes) {
    waiting_.push_back({ticket, offset, bytes});
    start(now);
  }

  // When something happens next: not always the end of a read.
  std::optional<double> next() const {
    if (active_.empty()) return std::nullopt;
    return std::min_element(active_.begin(), active_.end(), earlier)->at;
  }

  // Tickets of the reads that have ended by `now`, in the order of their ends.
  std::vector<std::uint64_t> advance(double now) {
    std::vector<std::uint64_t> ended;
    while (!active_.empty()) {
      const auto first = std::min_element(active_.begin(), active_.end(), earlier);
      if (first->at > now) break;
      if (first->transferring) {
        const double at = first->at;
        ended.push_back(first->read.ticket);
        active_.erase(first);
        start(at);
      } else {
        transfer(*first);
      }
    }
    return ended;
  }

  bool idle() const { return active_.empty() && waiting_.empty(); }

 private:
  struct Read {
    std::uint64_t ticket, offset, bytes;
  };
  struct Active {
    Read read;
    double at;  // of its first byte; of its last one while it is transferring
    bool transferring;
    std::uint64_t turn;
  };
  static bool earlier(const Active& a, const Active& b) { return a.at != b.at ? a.at < b.at : a.turn < b.turn; }

  void start(double now) {
    while (!waiting_.empty() && active_.size() < std::max(1u, model_.queueDepth)) {
      const Read read = waiting_.front();
      waiting_.pop_front();
      const bool near = model_.seeks && read.offset == head_;
      head_ = read.offset + read.bytes;
      active_.push_back({read, now + (near ? 0 : latency()), false, turns_++});
    }
  }

  void transfer(Active& active) {
    const double rate = model_.bytesPerSecond;
    active.at = std::max(active.at, free_) + (rate > 0 ? static_cast<double>(active.read.bytes) / rate : 0);
    active.transferring = true;
    free_ = active.at;
  }

  double latency() {
    const double share = (static_cast<double>(random_() >> 8) + 1) / 16777216.0;  // (0, 1]
    return model_.latency - model_.jitter * std::log(share);
  }

  DiskModel model_;
  std::mt19937 random_;
  std::deque<Read> waiting_;
  std::vector<Active> active_;
  double free_ = 0;         // when the pipe is
  std::uint64_t head_ = 0;  // where the last read that got its turn ends
  std::uint64_t turns_ = 0;
};

}  // namespace billow::tests

#endif  // BILLOW_TESTS_DISK_SCHEDULE_H
